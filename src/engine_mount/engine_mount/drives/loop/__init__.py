"""A run without middleware: the same controller and simulator, called one after the other."""
