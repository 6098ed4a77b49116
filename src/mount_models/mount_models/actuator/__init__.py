"""The electromagnet as the controller knows it: its force law."""
