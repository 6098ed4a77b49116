"""The coil's switching ripple: what it shows of the air gap, and the simulated coil that stands for the real one."""
