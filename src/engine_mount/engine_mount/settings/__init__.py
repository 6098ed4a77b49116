"""Settings of a run as a user of the desk gives them, and as the session of a recording holds them."""
