"""The recorder: from messages that arrive to a bag."""
