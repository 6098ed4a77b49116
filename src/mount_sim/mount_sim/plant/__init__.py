"""The plant behind the electronics and its laws: coil, actuator, mount, vehicle."""
