"""Launch files, configuration and the supervisor of the graph."""
