"""Messages as numbers and back, without an executor."""
