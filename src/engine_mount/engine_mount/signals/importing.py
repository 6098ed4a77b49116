"""A foreign file made into a recording that every command takes."""

from collections.abc import Callable, Collection, Sequence
from collections.abc import Mapping as Keys
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from engine_mount.signals.channels import (
    ACCELERATION,
    CHASSIS,
    DISPLACEMENT,
    ENGINE,
    SCENARIO,
    SHORTEST,
    channels_of,
    write_channels,
)
from engine_mount.signals.excitation import LONGEST_GAP
from engine_mount.signals.formats.content import NOT_STATED, Stated
from engine_mount.signals.formats.measured import listed
from engine_mount.signals.formats.reading import headings
from engine_mount.signals.mapping import MEAN, ColumnChoice, Mapping, mapping_in_file, with_options
from engine_mount.signals.quantities import QUANTITIES, titled
from engine_mount.signals.selection import Selection, select
from engine_mount.signals.signal import FEWEST, SECOND, Signal, SignalError
from engine_mount.signals.times import is_time
from engine_mount.signals.units import is_unit
from mount_recorder.session import new_session

DRIVING = (DISPLACEMENT, ENGINE, CHASSIS, ACCELERATION)
"""Quantities that controller or simulated car follow: a longer gap in one parts the recording."""
_BY_TITLES = Mapping()
Span = tuple[int, int]  # begin and end, ns
Part = tuple[int, int, dict[str, Signal]]
"""What of all signals lies between two gaps, from its begin to its end in ns on the clock of the signals."""


@dataclass
class Imported:
    """What came of it: recordings in the order of time, with the length (s) of each, and what to know.

    `samples` counts messages by topic, of all recordings.
    """

    recordings: list[Path] = field(default_factory=list)
    lengths: list[float] = field(default_factory=list)
    samples: dict[str, int] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)


def import_file(
    file: str | Path,
    out: str | Path,
    *,
    columns: Sequence[str] = (),
    time: str = '',
    rate: float | None = None,
    mapping: Mapping | str | Path = _BY_TITLES,
    stated: Stated = NOT_STATED,
    progress: Callable[[float, str], None] = lambda share, what: None,
) -> Imported:
    """Write a foreign `file`, path or URI, as the recording `out`, or one with a number for each part.

    `columns` are `[QUANTITY=]COLUMN[:UNIT]` beside what titles say, `time` is the column of the times, `rate`
    (Hz) that of a file without any; `mapping` is a mapping file, or what it holds, `stated` what a reader
    cannot know. Raises a `ValueError` or `OSError` with the reason, before anything is written.
    """
    name = '' if isinstance(mapping, Mapping) else str(mapping)
    chosen = mapping if isinstance(mapping, Mapping) else mapping_in_file(Path(mapping))
    chosen = with_options(chosen, columns, time, rate, stated=stated)
    progress(0.0, 'reading')
    selection = read_file(file, chosen)
    parts, cuts = _parts_of(selection.signals)
    own = (note for signal in selection.signals.values() for note in signal.notes)
    notes = [*selection.notes, *own, *cuts]
    selection = selection._replace(signals={})  # else an hour is held to the end
    shift = 0
    if parts[0][0] < SECOND:  # a replay dates the force table before the first sample
        shift = SECOND - min(parts[0][0], 0)
        notes.append(f'stamps are those of the file and {shift / SECOND:.3f} s')
    imported, written = Imported(), []
    while parts:
        begin, end, inside = parts.pop(0)
        signals = {name: one._replace(begin=one.begin + shift) for name, one in inside.items()}
        channels, done = channels_of(signals, selection.quantities)
        notes += done
        written.append(channels)
        imported.lengths.append((end - begin) / SECOND)
    del inside, signals
    imported.notes = list(dict.fromkeys(notes))
    for number, channels in enumerate(written):
        folder = Path(out)
        if len(written) > 1:
            folder = folder.with_name(f'{folder.name}_{number + 1}')
        told = {
            'files': [selection.provenance.for_session()],
            'piece': f'{number + 1} of {len(written)}',
            'mapping': chosen.for_session(name),
            'columns': selection.columns,
            'topics': {f'/{one.topic.name}': f'{one.field} in {one.unit}' for one in channels},
            'notes': imported.notes,
        }
        session = new_session({'scenario': SCENARIO, 'mode': 'import', 'imported': told})

        def show(share: float, begun: int = number) -> None:
            progress((begun + share) / len(written), 'writing')

        write_channels(folder, channels, session, show)
        imported.recordings.append(folder)
        for channel in channels:
            topic = f'/{channel.topic.name}'
            imported.samples[topic] = imported.samples.get(topic, 0) + channel.values.size
    return imported


def read_file(file: str | Path, mapping: Mapping) -> Selection:
    """Return what `mapping` names of a file; without columns, what titles and units tell.

    Without another offset the mean of a displacement is its rest position. Raises `SignalError` or
    `SourceError`.
    """
    columns = dict(mapping.columns)
    if not mapping.choices:
        there = headings(file, mapping.stated)
        for heading in there:
            found = titled(heading.name.rpartition('/')[2].rpartition('.')[2])
            if found is not None and not is_time(heading) and is_unit(heading.unit, found.dimension):
                columns.setdefault(found.name, ColumnChoice(heading.name))
        if not columns:
            raise SignalError(
                f'{file}: no column tells by its title and unit what it is; say it with --column '
                f'QUANTITY=COLUMN:UNIT or a mapping file. Quantities: {", ".join(QUANTITIES)}. Columns: '
                f'{listed(there)}'
            )
    for name in {DISPLACEMENT, ENGINE, CHASSIS} & columns.keys():
        if columns[name].offset is None:
            columns[name] = replace(columns[name], offset=MEAN)
    return select(file, replace(mapping, columns=columns))


def _parts_of(signals: Keys[str, Signal]) -> tuple[list[Part], list[str]]:
    """Return the parts of `signals` (SI) without gaps of more than `LONGEST_GAP`, and sentences on the cuts.

    Raises `SignalError` where no part is as long as `SHORTEST`.
    """
    driving = [signal for name, signal in signals.items() if name in DRIVING]
    spans = _spans(driving) if driving else [_whole(signals.values())]
    long_enough = [span for span in spans if span[1] - span[0] >= SHORTEST * SECOND]
    if not long_enough:
        longest = max((end - begin for begin, end in spans), default=0) / SECOND
        raise SignalError(
            f'{", ".join(one.name for one in driving or signals.values())}: the longest part without a gap '
            f'of more than {LONGEST_GAP:g} s is {longest:.3f} s long; {SHORTEST:g} s are needed'
        )
    notes = [
        f'a gap of {(after - end) / SECOND:.3f} s at {(end - spans[0][0]) / SECOND:.3f} s: what follows it '
        'is a drive of its own'
        for (_, end), (after, _) in pairwise(spans)
    ]
    short = len(spans) - len(long_enough)
    if short:
        notes.append(f'{short} parts shorter than {SHORTEST:g} s between gaps are left out')
    return [_part(signals, span) for span in long_enough], notes


def _whole(signals: Collection[Signal]) -> Span:
    begins = [one.begin + round(SECOND * float(one.times.min())) for one in signals]
    ends = [one.begin + round(SECOND * float(one.times.max())) for one in signals]
    return min(begins), max(ends)


def _spans(signals: Sequence[Signal]) -> list[Span]:
    """Return where all signals are without gaps, in order."""
    own = [_whole([signal]) for signal in signals]
    at, end = max(begin for begin, _ in own), min(end for _, end in own)
    pauses: list[list[int]] = []
    for signal in signals:
        places = np.flatnonzero(np.diff(signal.times) > LONGEST_GAP)
        sides = np.stack([signal.times[places], signal.times[places + 1]], axis=1)
        pauses += (signal.begin + np.rint(SECOND * sides).astype(np.int64)).tolist()
    spans = []
    for before, after in [*sorted(pauses), [end, end]]:
        if min(before, end) > at:
            spans.append((at, min(before, end)))
        at = max(at, after)
    return spans


def _part(signals: Keys[str, Signal], span: Span) -> Part:
    """Return the samples between two times, both included; signals with too few there are left out."""
    found = {}
    for name, signal in signals.items():
        begin, end = ((edge - signal.begin) / SECOND for edge in span)
        slack = 0.5 / SECOND  # of the rounding to ns
        inside = (signal.times >= begin - slack) & (signal.times <= end + slack)
        if inside.all():
            found[name] = signal
        elif np.count_nonzero(inside) >= FEWEST:
            times, values = signal.times[inside], signal.values[inside]
            first = signal.begin + round(SECOND * float(times[0]))
            found[name] = signal._replace(times=times - times[0], values=values, begin=first)
    return *span, found
