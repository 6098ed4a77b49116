"""The plant behind the electronics: coil, actuator, mount, vehicle."""
