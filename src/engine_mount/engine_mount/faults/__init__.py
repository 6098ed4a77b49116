"""The fault matrix: each fault in the real graph, and what the graph does held against what it must."""
