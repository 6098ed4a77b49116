"""Foreign files made into recordings that every command takes."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from engine_mount.signals.formats.content import Stated
from engine_mount.signals.importing.channels import Channel, channels_of
from engine_mount.signals.importing.parts import join_files, parts_of, within
from engine_mount.signals.importing.provenance import SCENARIO, Told, told_mapping, told_provenance
from engine_mount.signals.importing.reading import read_files
from engine_mount.signals.importing.writing import write_channels
from engine_mount.signals.mapping import Mapping, mapping_in_file, with_options
from engine_mount.signals.selection import Selection
from engine_mount.signals.signal import SECOND
from mount_recorder.session import new_session

Progress = Callable[[float, str], None]

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


def import_files(
    files: Sequence[str | Path],
    out: str | Path,
    *,
    columns: Sequence[str] = (),
    time: str = '',
    rate: float | None = None,
    mapping: Mapping | str | Path = _BY_TITLES,
    stated: Stated | None = None,
    first: float | None = None,
    last: float | None = None,
    progress: Progress = lambda share, what: None,
) -> Imported:
    """Write foreign `files`, paths or URIs, as the recording `out`, or one with a number for each part.

    `columns` are `[QUANTITY=]COLUMN[:UNIT]` beside what titles say, `time` is the column of the times, `rate`
    (Hz) that of files without any; `mapping` is a mapping file, or what it holds, `stated` what a reader
    cannot know. `first` and `last` (s after the first sample of all) choose a part. Raises a `ValueError` or
    `OSError` with the reason, before anything is written.
    """
    name = '' if isinstance(mapping, Mapping) else Path(mapping).name
    chosen = mapping if isinstance(mapping, Mapping) else mapping_in_file(Path(mapping))
    chosen = with_options(chosen, columns, time, rate, stated=stated)
    progress(0.0, 'reading')
    selections = read_files([str(file) for file in files], chosen)
    signals, notes = join_files([(one.name, one.signals) for one in selections])
    notes = [note for one in selections for note in one.notes] + notes
    notes += [note for signal in signals.values() for note in signal.notes]
    parts, cuts = parts_of(within(signals, first, last))
    notes += cuts
    shift = SECOND - parts[0].begin  # a replay dates the force table before the first sample
    if shift > 0:
        parts = [part.later(shift) for part in parts]
        notes.append(f'stamps are those of the file and {shift / SECOND:.3f} s')
    quantities = {name: quantity for one in selections for name, quantity in one.quantities.items()}
    selections, signals = (
        [replace(one, signals={}) for one in selections],
        {},
    )  # else an hour is held to the end
    imported, written = Imported(), []
    while parts:
        part = parts.pop(0)
        channels, done = channels_of(part.signals, quantities)
        notes += done
        written.append(channels)
        imported.lengths.append((part.end - part.begin) / SECOND)
    del part
    imported.notes = list(dict.fromkeys(notes))
    for number, channels in enumerate(written):
        folder = Path(out)
        if len(written) > 1:
            folder = folder.with_name(f'{folder.name}_{number + 1}')
        session = _session(
            told_mapping(chosen, name),
            selections,
            channels,
            imported.notes,
            f'{number + 1} of {len(written)}',
        )

        def show(share: float, begun: int = number) -> None:
            progress((begun + share) / len(written), 'writing')

        write_channels(folder, channels, session, show)
        imported.recordings.append(folder)
        for channel in channels:
            topic = f'/{channel.place.topic.name}'
            imported.samples[topic] = imported.samples.get(topic, 0) + int(channel.stamps.size)
    return imported


def _session(
    mapping: Told,
    files: Sequence[Selection],
    channels: Sequence[Channel],
    notes: Sequence[str],
    piece: str,
) -> dict[str, Any]:
    places = [(channel.place, channel.unit) for channel in channels]
    imported = {
        'files': [told_provenance(one.provenance) for one in files],
        'piece': piece,
        'mapping': mapping,
        'columns': {name: told for one in files for name, told in one.columns.items()},
        'topics': {f'/{place.topic.name}': f'{place.field} in {unit}' for place, unit in places},
        'notes': list(notes),
    }
    return new_session({'scenario': SCENARIO, 'mode': 'import', 'imported': imported})
