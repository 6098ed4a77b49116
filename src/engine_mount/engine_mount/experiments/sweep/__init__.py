"""The experiment `sweep`."""

TITLE = 'Front wheels from 1 to 50 Hz'
REFERENCE = 'Fig. 14'
"""What it repeats of the paper."""
