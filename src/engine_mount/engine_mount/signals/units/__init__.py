"""Units and times of measured columns: said, checked for plausibility, and turned into signals in SI."""
