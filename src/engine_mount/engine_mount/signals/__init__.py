"""Recordings of others: fetched from any store, read from any format, with their units and times said."""
