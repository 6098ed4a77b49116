"""The experiment `inductance_map`."""

TITLE = 'Incremental inductance over current and gap'
REFERENCE = 'Fig. 4'
"""What it repeats of the paper."""
