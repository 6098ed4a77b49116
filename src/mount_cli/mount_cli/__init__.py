"""The `engine-mount` command."""
