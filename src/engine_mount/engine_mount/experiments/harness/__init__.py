"""What experiments share: their contract, runs in closed loop, drawing, numbers."""
