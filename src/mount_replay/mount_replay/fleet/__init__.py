"""Many recordings: indexed, replayed with other parameters, asked."""
