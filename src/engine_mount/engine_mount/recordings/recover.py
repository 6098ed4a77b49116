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
from engine_mount.recordings.metadata import read_statement
from engine_mount.recordings.recording import open_recording
from mount_recorder.losses import RECORDER_RECORD

Progress = Callable[[int, int], None]  # messages done, messages in all


class RecoveryError(ValueError):
    """Nothing of a recording can be recovered; the text says why."""


@dataclass(frozen=True)
class Recovery:
    """What was kept and what is lost.

    `lost` messages are None where no summary or description counts them: then the `lost_bytes` of the file
    that are not readable say how much it is. `lost_before` never reached the file: its recorder says so.
    """

    folder: Path
    kept: int
    lost: int | None
    kept_seconds: float  # from the first to the last message
    kept_bytes: int
    lost_bytes: int
    complete: bool  # nothing of the file is lost
    lost_before: int
    notes: tuple[str, ...]

    def __str__(self) -> str:
        kept = f'kept {self.kept} messages, {self.kept_seconds:.3f} s, {_size(self.kept_bytes)}'
        lost = 'nothing of the file is missing' if self.complete else f'lost {self._lost_text()}'
        if self.lost_before:
            lost += f', but {self.lost_before} messages never reached it, as its recorder says'
        return f'{kept}; {lost}'

    def _lost_text(self) -> str:
        unreadable = f'{_size(self.lost_bytes)} of the file not readable'
        if self.lost is not None:
            return f'{self.lost} messages, {unreadable}'
        return f'{unreadable}, and what followed the last whole chunk: how much, the file cannot tell'


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
        stored = 0  # in the files, repetitions included
        for file, block, repeated in recording.stored_blocks(
            {file: list(file.topics) for file in recording.files}
        ):
            stored += len(block) + repeated
            heads = block.heads[['topic', 'log_time', 'publish_time', 'sequence']].tolist()
            for (number, *head), raw in zip(heads, map(bytes, block.payloads()), strict=True):
                bag.write(channels[file, number], raw, *head)
            if progress is not None:
                progress(bag.added, recording.message_count)
        if not bag.added:
            reasons = '; '.join(recording.warnings) or 'it is empty'
            raise RecoveryError(f'{path} holds no message that can be recovered: {reasons}')
        custom = dict(recording.information.custom_data) if recording.information else {}
        custom['recovered_from'] = f'{recording.path.name}: {stored} messages'
        bag.complete([recording], None, custom)
    expected = recording.described_count
    if recording.proven:
        expected = sum(sum(file.message_counts.values()) for file in recording.files)
    complete = recording.whole and (expected is None or expected <= stored)
    lost_bytes = sum(file.lost_bytes for file in recording.files)
    statements = [read_statement(file.metadata.get(RECORDER_RECORD, {})) for file in recording.files]
    return Recovery(
        folder=bag.folder,
        kept=bag.added,
        lost=0 if complete else None if expected is None else max(0, expected - stored),
        kept_seconds=bag.seconds,
        kept_bytes=sum(file.path.stat().st_size for file in recording.files) - lost_bytes,
        lost_bytes=lost_bytes,
        complete=complete,
        lost_before=sum(row.get('lost', 0) for rows in statements for row in rows.values()),
        notes=(*recording.warnings, *bag.notes),
    )


def _size(count: int) -> str:
    return f'{count / 1e6:.3f} MB' if count >= 1e5 else f'{count / 1e3:.2f} kB'
