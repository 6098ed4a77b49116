"""CAN logs (BLF, ASC, TRC, candump) decoded by a user's database: a column for each signal."""

from collections.abc import Sequence
from pathlib import Path

from engine_mount.signals.formats.broken import reading
from engine_mount.signals.formats.can.frames import EXTENDED, DecodedFrames
from engine_mount.signals.formats.content import Stated
from engine_mount.signals.formats.measured import Heading, MeasuredColumn
from engine_mount.signals.signal import SignalError


class CanLog:
    """A log of CAN frames, each message of the database that occurs as `Message.Signal`."""

    def __init__(self, path: Path, stated: Stated):
        from mount_driver.can_library import can

        self.format, self.reader = f'CAN log {path.suffix.lower()}', 'python-can, cantools'
        if stated.dbc is None:
            raise SignalError(
                f'{path} holds CAN frames; name the database that decodes them with --dbc, as .dbc or .kcd'
            )
        self._frames = DecodedFrames(path, stated.dbc)
        self.notes = self._frames.notes
        other = 0
        arguments = {'relative_timestamp': False} if path.suffix.lower() == '.asc' else {}
        with reading(path, 'CAN log'), can.LogReader(str(path), **arguments) as reader:
            for frame in reader:
                if frame.is_error_frame or frame.is_remote_frame:
                    other += 1
                    continue
                channel = '' if frame.channel is None else str(frame.channel)
                key = frame.arbitration_id | (EXTENDED if frame.is_extended_id else 0)
                self._frames.take(channel, key, frame.timestamp, bytes(frame.data))
        if other:
            self.notes.append(f'{other} error and remote frames are left out')
        self.headings: Sequence[Heading] = self._frames.settle()

    def load(self, chosen: Sequence[Heading]) -> list[MeasuredColumn]:
        """Return the chosen signals at the times of their frames; frames that do not decode are counted."""
        return self._frames.load(chosen)


def is_can_log(path: Path) -> bool:
    """Return whether a text file is a log of CAN frames: ASC and candump share their suffixes with tables."""
    suffix = path.suffix.lower()
    if suffix in ('.blf', '.trc'):
        return True
    if suffix not in ('.asc', '.log'):
        return False
    with path.open('rb') as file:
        head = file.read(4096).decode('latin-1')
    if suffix == '.asc':
        return any(line.startswith(('date ', 'base hex', 'base dec')) for line in head.splitlines())
    return any(line.startswith('(') and '#' in line for line in head.splitlines()[:5])
