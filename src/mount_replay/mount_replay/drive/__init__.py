"""One simulated drive: in real time, in lock-step, or without middleware."""
