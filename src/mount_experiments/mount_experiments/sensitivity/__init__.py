"""The experiment `sensitivity`."""
