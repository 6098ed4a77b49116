"""Figures of a drive, pages and pictures about recordings."""
