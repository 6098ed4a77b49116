"""The experiment `sawtooth`."""
