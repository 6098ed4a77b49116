"""`engine-mount fleet`: many recordings, one file for each sub-command."""
