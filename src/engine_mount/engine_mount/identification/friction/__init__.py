"""The friction model fitted to recordings, beside simpler laws."""
