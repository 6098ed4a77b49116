"""Dry friction of the mount's pads: coefficient and simplified model."""
