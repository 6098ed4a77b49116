"""A fleet to try things on: short simulated drives, varied, a few of them damaged."""
