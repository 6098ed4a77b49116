"""The rungs of the ladder: friction laws of rising complexity behind one contract."""
