"""The ripple inductance over current, gap and temperature, fitted to recordings."""
