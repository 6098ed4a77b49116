"""The manoeuvre suite: what a change must pass before it goes into the car."""
