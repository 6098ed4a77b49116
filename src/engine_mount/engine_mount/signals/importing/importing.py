"""A foreign file made into a recording that every command takes."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from engine_mount.signals.formats.content import Stated
from engine_mount.signals.formats.measured import listed
from engine_mount.signals.formats.reading import headings
from engine_mount.signals.importing.channels import CHASSIS, DISPLACEMENT, ENGINE, Channel, channels_of
from engine_mount.signals.importing.parts import parts_of
from engine_mount.signals.importing.writing import (
    SCENARIO,
    Told,
    told_mapping,
    told_provenance,
    write_channels,
)
from engine_mount.signals.mapping import MEAN, ColumnChoice, Mapping, mapping_in_file, with_options
from engine_mount.signals.quantities import QUANTITIES, titled
from engine_mount.signals.selection import Selection, select
from engine_mount.signals.signal import SECOND, SignalError
from engine_mount.signals.times import is_time
from engine_mount.signals.units import is_unit
from mount_recorder.session import new_session

_BY_TITLES = Mapping()


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
    stated: Stated | None = None,
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
    parts, cuts = parts_of(selection.signals)
    own = (note for signal in selection.signals.values() for note in signal.notes)
    notes = [*selection.notes, *own, *cuts]
    selection = replace(selection, signals={})  # else an hour is held to the end
    shift = 0
    if parts[0].begin < SECOND:  # a replay dates the force table before the first sample
        shift = SECOND - min(parts[0].begin, 0)
        notes.append(f'stamps are those of the file and {shift / SECOND:.3f} s')
    imported, written = Imported(), []
    while parts:
        part = parts.pop(0)
        signals = {name: replace(one, begin=one.begin + shift) for name, one in part.signals.items()}
        channels, done = channels_of(signals, selection.quantities)
        notes += done
        written.append(channels)
        imported.lengths.append((part.end - part.begin) / SECOND)
    del part, signals
    imported.notes = list(dict.fromkeys(notes))
    for number, channels in enumerate(written):
        folder = Path(out)
        if len(written) > 1:
            folder = folder.with_name(f'{folder.name}_{number + 1}')
        piece = f'{number + 1} of {len(written)}'
        session = _session(told_mapping(chosen, name), selection, channels, imported.notes, piece)

        def show(share: float, begun: int = number) -> None:
            progress((begun + share) / len(written), 'writing')

        write_channels(folder, channels, session, show)
        imported.recordings.append(folder)
        for channel in channels:
            topic = f'/{channel.place.topic.name}'
            imported.samples[topic] = imported.samples.get(topic, 0) + int(channel.stamps.size)
    return imported


def _session(
    mapping: Told, selection: Selection, channels: Sequence[Channel], notes: Sequence[str], piece: str
) -> dict[str, Any]:
    imported = {
        'files': [told_provenance(selection.provenance)],
        'piece': piece,
        'mapping': mapping,
        'columns': selection.columns,
        'topics': {f'/{one.place.topic.name}': f'{one.place.field} in {one.unit}' for one in channels},
        'notes': list(notes),
    }
    return new_session({'scenario': SCENARIO, 'mode': 'import', 'imported': imported})


def read_file(file: str | Path, mapping: Mapping) -> Selection:
    """Return what `mapping` names of a file; without columns, what titles and units tell.

    Without another offset the mean of a displacement is its rest position. Raises `SignalError` or
    `SourceError`.
    """
    columns = dict(mapping.columns) if mapping.choices else _columns_by_titles(file, mapping)
    for name in {DISPLACEMENT, ENGINE, CHASSIS} & columns.keys():
        if columns[name].offset is None:
            columns[name] = replace(columns[name], offset=MEAN)
    return select(file, replace(mapping, columns=columns))


def _columns_by_titles(file: str | Path, mapping: Mapping) -> dict[str, ColumnChoice]:
    """Return the columns whose title tells the quantity and whose header tells the unit."""
    there = headings(file, mapping.stated)
    columns: dict[str, ColumnChoice] = {}
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
    return columns
