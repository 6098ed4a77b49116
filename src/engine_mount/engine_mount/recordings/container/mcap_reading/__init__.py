"""Reads MCAP files, damaged ones included."""
