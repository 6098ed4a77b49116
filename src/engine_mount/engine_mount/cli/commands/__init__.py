"""The sub-commands of `engine-mount`, one file each: what they take, say and return."""
