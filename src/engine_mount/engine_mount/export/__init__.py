"""What runs elsewhere, made from this project: the control law as C for the electronics."""
