"""The experiment `sensitivity`."""

TITLE = 'What the comparison with the hydromount depends on'
REFERENCE = 'Figs. 13, 14'
"""What it repeats of the paper."""
