"""Dry friction of the mount's pads: coefficient, simplified model (control), full model (plant)."""
