"""Whether anything was lost, unanswered or wrong."""
