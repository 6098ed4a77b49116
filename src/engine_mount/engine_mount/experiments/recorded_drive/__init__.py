"""The experiment `recorded_drive`."""

TITLE = 'A recorded drive'
REFERENCE = 'Sec. 7'
"""What it repeats of the paper."""
