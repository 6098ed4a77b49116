"""Raw CAN frames within MDF 4 files, as bus loggers record them (ASAM MDF, bus logging)."""

from pathlib import Path
from typing import Any

import numpy as np

from engine_mount.signals.formats.broken import reading
from engine_mount.signals.formats.can.frames import EXTENDED, DecodedFrames
from engine_mount.signals.signal import SignalError

FRAME = 'CAN_DataFrame'
"""The channel that holds frames, a record of what `_MEMBERS` name and others."""
OTHER_FRAMES = ('CAN_ErrorFrame', 'CAN_RemoteFrame', 'CAN_OverloadFrame')
_MEMBERS = ('ID', 'DataLength', 'DataBytes')
_AT_ONCE = 1 << 17  # frames, chosen: 10 MB of classic frames


def frames_in_mdf(file: Any, path: Path, dbc: Path, begin: int) -> DecodedFrames:
    """Return all frames of an opened file; `begin` (ns since 1970, or 0) is when its times begin.

    asammdf decodes frames itself, but takes those that are too short for their message as filled with zeros;
    so they are decoded here as those of logs are. Raises `SignalError`.
    """
    frames = DecodedFrames(path, dbc, begin)
    with reading(path, 'MDF file'):
        for number, group in enumerate(file.groups):
            for index, channel in enumerate(group.channels):
                if channel.name == FRAME:
                    _take_group(frames, file, path, (number, index))
    return frames


def _take_group(frames: DecodedFrames, file: Any, path: Path, at: tuple[int, int]) -> None:
    number, index = at
    for first in range(0, int(file.groups[number].channel_group.cycles_nr), _AT_ONCE):
        signal = file.get(group=number, index=index, record_offset=first, record_count=_AT_ONCE)
        members = {
            str(name).rpartition('.')[2]: signal.samples[name] for name in signal.samples.dtype.names or ()
        }
        missing = [name for name in _MEMBERS if name not in members]
        if missing:
            raise SignalError(
                f'{path}: its {FRAME} has no {", ".join(missing)}; needed are {", ".join(_MEMBERS)} of ASAM '
                'MDF bus logging'
            )
        extended = members.get('IDE', np.zeros(len(signal.samples), np.uint8)).astype(bool)
        keys = members['ID'].astype(np.int64) & 0x1FFFFFFF
        keys[extended | (members['ID'].astype(np.int64) & EXTENDED > 0)] |= EXTENDED
        channels = members.get('BusChannel', np.zeros(len(signal.samples), np.uint8)).astype(np.int64)
        times = np.asarray(signal.timestamps, np.float64)
        lengths = members['DataLength'].astype(np.int64)
        data = np.ascontiguousarray(members['DataBytes'], np.uint8)
        for channel, key in np.unique(np.column_stack([channels, keys]), axis=0).tolist():
            rows = np.flatnonzero((channels == channel) & (keys == key))
            inside = np.arange(data.shape[1]) < lengths[rows, None]
            frames.take_many(str(channel), key, times[rows], inside.sum(axis=1), data[rows][inside].tobytes())
