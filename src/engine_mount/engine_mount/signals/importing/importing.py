"""A foreign file made into a recording that every command takes."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from engine_mount.signals.formats.content import Stated
from engine_mount.signals.importing.channels import Channel, channels_of
from engine_mount.signals.importing.parts import parts_of
from engine_mount.signals.importing.provenance import SCENARIO, Told, told_mapping, told_provenance
from engine_mount.signals.importing.reading import read_file
from engine_mount.signals.importing.writing import write_channels
from engine_mount.signals.mapping import Mapping, mapping_in_file, with_options
from engine_mount.signals.selection import Selection
from engine_mount.signals.signal import SECOND
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
