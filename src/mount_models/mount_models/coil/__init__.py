"""The coil's switching ripple: what it tells of the air gap, and the simulated coil."""
