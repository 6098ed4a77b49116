"""The experiment `inductance_map`."""
