"""Identification of a friction contact from measured displacement and force.

Step 1 (`ramp_hold`): springs and damper of the contact. Steps 2 and 3 (`sawtooth`, `coefficient_fit`):
the coefficient of Eqs (12)-(14). `ladder` fits laws of rising complexity to the same recordings and lets
recordings that no fit has seen decide.
"""
