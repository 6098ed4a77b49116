"""Recording, reading and auditing of drives in rosbag2 MCAP bags."""

from mount_bags.reading import ReadingError, Recording, open_recording
from mount_bags.series import Series, SeriesError
from mount_bags.writer import BagWriter, RecordingError

open = open_recording

__all__ = [
    'BagWriter',
    'ReadingError',
    'Recording',
    'RecordingError',
    'Series',
    'SeriesError',
    'open',
    'open_recording',
]
