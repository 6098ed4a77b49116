"""Recordings of a rack as files: columns, units, samples."""
