"""The far end of the CAN bus: electronics, actuator, friction contact and vehicle, simulated."""
