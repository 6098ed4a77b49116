"""The experiment `motorway_gap`."""
