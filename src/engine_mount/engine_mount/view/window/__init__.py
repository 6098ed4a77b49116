"""What is shown: traces cut into short intervals, and the state of the graph."""
