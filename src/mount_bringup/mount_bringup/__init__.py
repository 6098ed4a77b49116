"""Launch files, configuration, supervisor and the engine-mount command."""
