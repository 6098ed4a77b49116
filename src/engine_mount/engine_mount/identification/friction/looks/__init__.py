"""What one recording shows before any law is chosen: the zero of its force, what its contact does."""
