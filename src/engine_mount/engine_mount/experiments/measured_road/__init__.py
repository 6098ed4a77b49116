"""The experiment `measured_road`."""

TITLE = 'A measured road'
REFERENCE = 'Sec. 7'
"""What it repeats of the paper: there it is a good road and a motorway."""
