"""The nodes as processes: which there are, in which order they live, and that they end at 0 A."""
