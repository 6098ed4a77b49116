"""Files of others as recordings of this project: joined, cut at gaps, written with where they came from."""
