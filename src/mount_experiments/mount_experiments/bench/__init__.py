"""The experiment `bench`."""
