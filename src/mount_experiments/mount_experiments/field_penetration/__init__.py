"""The experiment `field_penetration`."""
