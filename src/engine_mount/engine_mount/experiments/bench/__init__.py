"""The experiment `bench`."""

TITLE = 'Friction mount and hydromount on a test rack'
REFERENCE = 'Fig. 13'
"""What it repeats of the paper."""
