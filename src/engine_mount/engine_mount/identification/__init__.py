"""From recordings of a rack to the actuator, the coil and the pads of a specimen.

`identify` holds the functions `friction` and `drift`, `calibrate` holds `actuator`, `inductance` and `rack`.
"""
