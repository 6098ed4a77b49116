"""Air gap and current-force table of the engine mount, estimated at each activation."""
