"""How the friction drifts from drive to drive."""
