"""Recording, reading and auditing of drives in rosbag2 MCAP bags."""

from mount_bags.bag.recording import ReadingError, Recording, open_recording
from mount_bags.bag.writer import BagWriter, RecordingError
from mount_bags.messages.series import Series, SeriesError

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
