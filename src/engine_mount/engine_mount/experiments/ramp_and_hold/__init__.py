"""The experiment `ramp_and_hold`."""

TITLE = 'Ramp and hold of the sticking contact'
REFERENCE = 'Fig. 7'
"""What it repeats of the paper."""
