"""From recordings to the friction of a specimen, its drift, and what temperature leaves."""
