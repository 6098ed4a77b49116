"""The experiment `sawtooth`."""

TITLE = 'Friction contact alone on a saw tooth'
REFERENCE = 'Figs. 8 to 11'
"""What it repeats of the paper."""
