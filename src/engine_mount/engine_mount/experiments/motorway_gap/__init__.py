"""The experiment `motorway_gap`."""

TITLE = 'Over a gap in the motorway'
REFERENCE = 'Fig. 15'
"""What it repeats of the paper."""
