"""Bands of frequency in which a mount is judged."""

BELOW_ISOLATION = (3.0, 14.0)
"""Hz: the resonance of the engine on its mounts, where the mount has to damp (Fig. 14)."""
ISOLATION_BANDS = ((14.0, 20.0), (20.0, 30.0), (30.0, 50.0))
"""Hz: damping is off there (Fig. 14); the borders are chosen."""
