"""What `calibrate` and `identify` share: options per file, what they print, what they write."""
