"""What another controller would have answered on many recordings: one row each, in any order, resumable."""
