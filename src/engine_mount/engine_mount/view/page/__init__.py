"""The page: what serves it, and its three files."""
