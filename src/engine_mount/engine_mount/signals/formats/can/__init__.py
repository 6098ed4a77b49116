"""CAN frames, of logs and within MDF files, decoded by a database of the user."""
