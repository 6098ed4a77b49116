"""CAN FD link to the electronics of the engine mount."""
