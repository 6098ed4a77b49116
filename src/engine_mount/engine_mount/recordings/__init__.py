"""Recordings read, audited, compared and edited."""

from engine_mount.recordings.recording import ReadingError, Recording, open_recording
from engine_mount.recordings.series import Series, SeriesError

open = open_recording

__all__ = ['ReadingError', 'Recording', 'Series', 'SeriesError', 'open', 'open_recording']
