"""The experiment `recorded_drive`."""
