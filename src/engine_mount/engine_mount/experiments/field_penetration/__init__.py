"""The experiment `field_penetration`."""

TITLE = "How far the ripple's field enters the iron"
REFERENCE = 'Fig. 3'
"""What it repeats of the paper."""
