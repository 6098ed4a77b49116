"""The experiment `policy`."""

TITLE = 'Control policies side by side'
REFERENCE = 'Figs. 14, 15; Secs. 6, 7'
"""What it repeats of the paper."""
