"""The current-force law fitted to measured points."""
