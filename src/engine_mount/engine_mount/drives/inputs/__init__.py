"""What a replay is given: samples, ramps and parameters of a recording, ours or foreign."""
