"""What can go wrong in electronics, sensors, coil, pads and on the bus; several faults at once."""
