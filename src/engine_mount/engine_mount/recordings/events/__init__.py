"""Marks and switchings: what in a recording is worth finding again."""
