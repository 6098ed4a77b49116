"""The electromagnet: the controller's force law and its fit, and the simulated actuator."""
