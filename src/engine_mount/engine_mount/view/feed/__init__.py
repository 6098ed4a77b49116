"""Where messages come from: a running graph, or a recording by the clock."""
