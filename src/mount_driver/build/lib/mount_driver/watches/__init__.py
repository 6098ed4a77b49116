"""What is watched: the coil, the status, who sends, the heat of the coil; no bus and no clock here."""
