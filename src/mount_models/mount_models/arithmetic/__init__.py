"""Arithmetic that gives the same bits on every processor, and how laws are compiled."""
