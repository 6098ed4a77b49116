"""Switched, viscous-like friction damping at 1 kHz."""
