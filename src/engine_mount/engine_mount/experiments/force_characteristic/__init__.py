"""The experiment `force_characteristic`."""

TITLE = 'Force of the actuator over current and gap'
REFERENCE = 'Fig. 2'
"""What it repeats of the paper."""
