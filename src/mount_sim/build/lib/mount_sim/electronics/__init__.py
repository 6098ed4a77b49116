"""The electronics' end of the CAN bus: sensors, current loop, faults."""
