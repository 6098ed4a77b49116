"""The experiment `ramp_and_hold`."""
