"""Steps 1 to 3 of the paper: ramp and hold, strokes of saw tooths, coefficients; and their validation."""
