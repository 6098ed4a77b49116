"""A run: its folder, its session, what it was made with."""
