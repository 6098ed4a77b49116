"""Bytes of MCAP and SQLite files: chunks, indexes, compression."""
