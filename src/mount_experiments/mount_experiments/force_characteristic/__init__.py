"""The experiment `force_characteristic`."""
