"""Physics and laws that the nodes of the car load: actuator, coil, friction, damper."""
