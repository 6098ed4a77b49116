"""Serialised messages as columns of numbers, with their times."""
