"""The simulated test rack: what it measures of actuator, coil and friction, as files or arrays."""
