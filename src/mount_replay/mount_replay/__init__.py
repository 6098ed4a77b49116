"""A recording once more through the controller: in the core, through the real node, or to look at."""
