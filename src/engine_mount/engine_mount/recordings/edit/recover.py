"""Makes a sound recording out of a cut or damaged one: whatever is proven, and what is left is told.

Every whole chunk is taken as it is, with topics, quality of service, times and custom data. A chunk that the
end of the file cuts off is lost: no checksum holds for a part of it, and of 64 KiB packed by zstd, in blocks
of up to 128 KiB, nothing can be unpacked.
"""

import itertools
import math
import os
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from engine_mount.recordings.edit.inherited_statement import inherited_statement, sources_of
from engine_mount.recordings.edit.verbatim import VerbatimBag
from engine_mount.recordings.mcap_file import McapFile
from engine_mount.recordings.mcap_records import Chunk
from engine_mount.recordings.metadata import read_statement
from engine_mount.recordings.pieces import repeated_topics
from engine_mount.recordings.recording import Recording, open_recording
from mount_recorder.losses import RECORDER_RECORD
from mount_recorder.metadata import NO_TIME
from mount_recorder.topic_groups import topic_group

_SECOND = 1e9  # ns
_NEAR = 600 * _SECOND  # chosen: chunks are shorter by far

Progress = Callable[[int, int], None]  # messages done, messages in all


class RecoveryError(ValueError):
    """Nothing of a recording can be recovered; the text says why."""


@dataclass(frozen=True)
class Recovery:
    """What was kept and what is lost; NaN and None where it cannot be told.

    `lost` is an estimate from bytes unless `lost_is_counted`. `lost_before` never reached the file: its
    recorder says so itself.
    """

    folder: Path
    kept: int
    lost: int | None
    lost_is_counted: bool
    kept_seconds: float
    lost_seconds: float
    kept_bytes: int
    lost_bytes: int
    all_messages: bool
    lost_beside: tuple[str, ...]  # names of attachments and metadata
    lost_before: int
    notes: tuple[str, ...]

    @property
    def complete(self) -> bool:
        """Whether nothing of the file is lost."""
        return self.all_messages and not self.lost_beside

    def __str__(self) -> str:
        kept = f'kept {self.kept} messages, {self.kept_seconds:.3f} s, {_size(self.kept_bytes)}'
        losses = [] if self.all_messages else [self._lost_text()]
        losses += [', '.join(self.lost_beside)] if self.lost_beside else []
        lost = f'lost {"; and ".join(losses)}' if losses else 'nothing of the file is missing'
        if self.lost_before:
            lost += f', but {self.lost_before} messages never reached it, as its recorder says'
        return f'{kept}; {lost}'

    def _lost_text(self) -> str:
        if self.lost is None:
            return 'what followed the last whole chunk: how much, the file cannot tell'
        about = '' if self.lost_is_counted else 'at least about '
        unknown = math.isnan(self.lost_seconds)
        seconds = 'a time that cannot be told' if unknown else f'{self.lost_seconds:.3f} s'
        more = '' if self.lost_is_counted else '; whether more followed, the file cannot tell'
        return (
            f'{about}{self.lost} messages, {seconds}, {_size(self.lost_bytes)} of the file not readable{more}'
        )


def recover(
    path: str | os.PathLike[str], out: str | os.PathLike[str], progress: Progress | None = None
) -> Recovery:
    """Write what is readable of the recording `path` to the new folder `out`.

    Raises `ReadingError` where nothing can be opened, `RecoveryError` where no message is left.
    """
    recording = open_recording(path)
    bag = VerbatimBag(out)
    try:
        stored = _copy(recording, bag, progress or _silent)
        bag.flush()
        if not bag.kept:
            raise RecoveryError(f'{path} holds no message that can be recovered: {_reasons(recording)}')
        custom = dict(recording.information.custom_data) if recording.information else {}
        custom['recovered_from'] = f'{recording.path.name}: {stored} messages'
        bag.copy_beside_messages([recording])
        sources = sources_of(recording, bag.kept_by_topic)
        if sources:
            bag.add_record(RECORDER_RECORD, inherited_statement(sources, bag.kept_by_topic))
        bag.close(custom, recording.information.ros_distro if recording.information else '')
    except BaseException:
        bag.discard()
        raise
    return _balance(recording, bag, stored)


def _copy(recording: Recording, bag: VerbatimBag, progress: Progress) -> int:
    """Write all messages to `bag` and return how many the files hold, repetitions included."""
    stored, expected = 0, recording.message_count
    last: dict[str, tuple[bytes, int]] = {}
    watched = frozenset().union(*repeated_topics(recording.files))
    for file, repeated in zip(recording.files, repeated_topics(recording.files), strict=True):
        targets = {number: bag.topic(topic) for number, topic in file.topics.items()}
        pending = set(repeated)
        for block in file.blocks(file.topics.keys()):
            stored += len(block)
            heads = block.heads[['topic', 'sequence', 'log_time', 'publish_time']].tolist()
            rows = zip(heads, map(bytes, block.payloads()), strict=True)
            for (number, sequence, log_time, publish_time), raw in rows:
                name = file.topics[number].name
                if name in watched:
                    is_first, same = name in pending, last.get(name) == (raw, publish_time)
                    pending.discard(name)
                    last[name] = raw, publish_time
                    if is_first and same:
                        continue
                bag.write(targets[number], raw, log_time, publish_time, sequence)
            progress(bag.kept + bag.pending, expected)
    return stored


# What is kept and what is lost.


def _balance(recording: Recording, bag: VerbatimBag, stored: int) -> Recovery:
    files = [file for file in recording.files if isinstance(file, McapFile)]
    lost_bytes = sum(_lost_bytes(file) for file in files)
    size = sum(file.path.stat().st_size for file in recording.files)
    expected = _expected(recording)
    lost = max(0, expected - stored) if expected is not None else _estimate(files, stored)
    inside = sum(_lost_inside(file) for file in files) / _SECOND
    span = bag.time_range or (0, 0)
    complete = recording.whole and not (lost and expected is not None)
    return Recovery(
        folder=bag.folder,
        kept=bag.kept,
        lost=0 if complete else lost,
        lost_is_counted=expected is not None,
        kept_seconds=(span[1] - span[0]) / _SECOND - inside,
        lost_seconds=0.0 if complete else inside + _lost_at_ends(recording, span),
        kept_bytes=size - lost_bytes,
        lost_bytes=lost_bytes,
        all_messages=complete,
        lost_beside=tuple(recording.lost_beside),
        lost_before=_lost_before(recording),
        notes=tuple(recording.warnings),
    )


def _estimate(files: Sequence[McapFile], kept: int) -> int | None:
    """Return about how many messages the damaged and cut-off chunks had, None if there is none such."""
    chunks = [(chunk, file.is_damaged(chunk)) for file in files for chunk in file.chunks]
    whole = [chunk for chunk, is_damaged in chunks if not is_damaged]
    unpacked = sum(chunk.size for chunk, is_damaged in chunks if is_damaged)
    unpacked += sum(file.tail.size for file in files if file.tail)
    packed = sum(part.end - part.begin for file in files for part in file.unexplained if part.end < file.size)
    share = unpacked / max(1, sum(chunk.size for chunk in whole))
    share += packed / max(1, sum(chunk.end - chunk.position for chunk in whole))
    return round(share * kept) or None


def _expected(recording: Recording) -> int | None:
    """Return how many messages there once were, None if no reliable source tells."""
    if recording.proven:
        return sum(sum(file.message_counts.values()) for file in recording.files)
    information = recording.information
    return information.message_count if information is not None and recording.described else None


def _lost_before(recording: Recording) -> int:
    statements = [read_statement(file.metadata.get(RECORDER_RECORD, {})) for file in recording.files]
    return sum(row.get('lost', 0) for rows in statements for row in rows.values())


def _lost_bytes(file: McapFile) -> int:
    damaged = sum(chunk.end - chunk.position for chunk in file.chunks if file.is_damaged(chunk))
    return damaged + sum(stretch.end - stretch.begin for stretch in file.unexplained)


def _lost_inside(file: McapFile) -> int:
    """Return the ns between whole chunks of the same group with something lost between them."""
    losses = [chunk.position for chunk in file.chunks if file.is_damaged(chunk)]
    losses += [stretch.begin for stretch in file.unexplained]
    spans = [
        (before.end_time, after.start_time)
        for chunks in _by_group(file)
        for before, after in itertools.pairwise(chunks)
        if any(before.position < position < after.position for position in losses)
    ]
    lost, reached = 0, 0
    for begin, end in sorted(spans):  # each part once
        lost += max(0, end - max(begin, reached))
        reached = max(reached, end)
    return lost


def _by_group(file: McapFile) -> Iterable[list[Chunk]]:
    """Return the whole chunks of each group of topics, all in one where one may hold topics of several."""
    group_of = {number: topic_group(topic.name, topic.type) for number, topic in file.topics.items()}
    found: dict[frozenset[int | None], list[Chunk]] = {}
    for chunk in file.chunks:
        if not file.is_damaged(chunk):
            held = group_of.values() if chunk.channels is None else map(group_of.get, chunk.channels)
            found.setdefault(frozenset(held), []).append(chunk)
    if any(len(groups) > 1 for groups in found):
        return [sorted(itertools.chain(*found.values()), key=lambda chunk: chunk.position)]
    return found.values()


def _lost_at_ends(recording: Recording, kept: tuple[int, int]) -> float:
    """Return the s before the first and behind the last kept message, NaN if no source tells."""
    first, last = kept
    information = recording.information
    if recording.proven and recording.time_range:
        begin, end = recording.time_range
    elif information is not None and recording.described and information.starting_time != NO_TIME:
        begin, end = information.starting_time, information.starting_time + information.duration
    else:
        tail = getattr(recording.files[-1], 'tail', None)
        if tail is None or not _is_near(tail, kept):
            return math.nan
        # The chunk of the other group may be whole and of the same time.
        begin, end, last = first, tail.end_time, min(last, tail.start_time)
    return (max(0, first - begin) + max(0, end - last)) / _SECOND


def _is_near(tail: Chunk, kept: tuple[int, int]) -> bool:
    """Return whether the times of a chunk that was cut off, which no checksum covers, are to be believed."""
    first, last = kept
    return first - _NEAR <= tail.start_time <= tail.end_time <= last + _NEAR


def _reasons(recording: Recording) -> str:
    return '; '.join(recording.warnings) or 'it is empty'


def _size(count: int) -> str:
    return f'{count / 1e6:.3f} MB' if count >= 1e5 else f'{count / 1e3:.2f} kB'


def _silent(done: int, of: int) -> None:
    """Show no progress."""
