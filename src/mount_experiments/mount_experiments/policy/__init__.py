"""The experiment `policy`."""
