"""A recording published by the wall clock."""
