"""The coil's switching ripple, and what it tells of the air gap."""
