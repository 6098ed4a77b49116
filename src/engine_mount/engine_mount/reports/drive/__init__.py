"""The figures, the summary and the picture of one drive."""
