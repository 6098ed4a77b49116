"""Physics and laws of the semi-active engine mount: actuator, coil, friction, damper, vehicle."""
