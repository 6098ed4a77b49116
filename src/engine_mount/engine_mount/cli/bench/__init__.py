"""What matters for speed, measured beside its alternatives."""
