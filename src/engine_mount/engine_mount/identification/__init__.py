"""From recordings of a rack to the actuator and the coil of a specimen."""
