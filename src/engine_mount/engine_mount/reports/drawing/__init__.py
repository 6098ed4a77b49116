"""Charts as pictures and interactive pages."""
