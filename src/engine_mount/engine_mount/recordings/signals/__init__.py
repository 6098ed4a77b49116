"""Signals that others recorded: read from CSV, NPY, MCAP and JSON, evenly spaced, resampled, checked."""
