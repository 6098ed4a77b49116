"""Makes a sound recording out of a cut or damaged one: whatever is proven, and what is left is told.

Every whole chunk is taken as it is, with topics, quality of service, times and custom data. A chunk that the
end of the file cuts off is lost: no checksum holds for a part of it, and of 64 KiB packed by zstd, in blocks
of up to 128 KiB, nothing can be unpacked.
"""

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from engine_mount.recordings.bag_copy import BagCopy
from engine_mount.recordings.metadata import custom_data
from engine_mount.recordings.recording import open_recording

Progress = Callable[[int, int], None]  # messages done, messages in all


class RecoveryError(ValueError):
    """Nothing of a recording can be recovered; the text says why."""


@dataclass(frozen=True)
class Recovery:
    """What was kept and what is lost; `lost` is None where no summary or description counts the messages."""

    folder: Path
    kept: int
    lost: int | None
    kept_seconds: float  # from the first to the last message
    complete: bool  # nothing of the file is lost
    notes: tuple[str, ...]

    def __str__(self) -> str:
        kept = f'kept {self.kept} messages, {self.kept_seconds:.3f} s'
        if self.complete:
            return f'{kept}; nothing of the file is missing'
        if self.lost is None:
            return f'{kept}; lost what followed the last whole chunk: how much, the file cannot tell'
        return f'{kept}; lost {self.lost} messages'


def recover(
    path: str | os.PathLike[str], out: str | os.PathLike[str], progress: Progress | None = None
) -> Recovery:
    """Write what is readable of the recording `path` to the new folder `out`.

    Raises `ReadingError` where nothing can be opened, `RecoveryError` where no message is left.
    """
    recording = open_recording(path)
    with BagCopy(out) as bag:
        channels = {
            (file, number): bag.channel_of(topic)
            for file in recording.files
            for number, topic in file.topics.items()
        }
        for file in recording.files:
            for block in file.blocks(file.topics):
                heads = block.heads[['topic', 'log_time', 'publish_time', 'sequence']].tolist()
                for (number, *head), raw in zip(heads, map(bytes, block.payloads()), strict=True):
                    bag.write(channels[file, number], raw, *head)
                if progress is not None:
                    progress(bag.added, recording.message_count)
        if not bag.added:
            reasons = '; '.join(recording.warnings) or 'it is empty'
            raise RecoveryError(f'{path} holds no message that can be recovered: {reasons}')
        origin = {'recovered_from': f'{recording.path.name}: {bag.added} messages'}
        bag.complete(recording, {**custom_data(recording.information), **origin})
    expected = recording.described_count
    if recording.proven:
        expected = sum(sum(file.message_counts.values()) for file in recording.files)
    complete = recording.whole and (expected is None or expected <= bag.added)
    return Recovery(
        folder=bag.folder,
        kept=bag.added,
        lost=0 if complete else None if expected is None else max(0, expected - bag.added),
        kept_seconds=bag.seconds,
        complete=complete,
        notes=tuple(recording.warnings),
    )
