"""What each of many recordings is and holds: a row for it, and a row for each of its events."""
