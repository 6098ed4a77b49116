"""A recording once more through the controller: in the core, through the real node, or for viewing."""
