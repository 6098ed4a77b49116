"""Formats that nest: arrays by their paths, whatever file they come from."""
