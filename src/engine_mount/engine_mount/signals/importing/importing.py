"""Foreign files made into recordings that every command takes."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from engine_mount.signals.importing.channels import Channel, channels_of
from engine_mount.signals.importing.parts import join_files, parts_of, within
from engine_mount.signals.importing.provenance import SCENARIO, told_mapping, told_provenance
from engine_mount.signals.importing.reading import read_files
from engine_mount.signals.importing.writing import write_channels
from engine_mount.signals.mapping import Mapping
from engine_mount.signals.selection import Selection
from engine_mount.signals.signal import SECOND
from mount_recorder.session import new_session

Progress = Callable[[float, str], None]


@dataclass(frozen=True)
class ImportOrder:
    """What the user orders: files (paths or URIs), what is said of them, and where the recording goes.

    `first` and `last` (s after the first sample of all) choose a part; None is all.
    """

    files: Sequence[str]
    out: Path
    mapping: Mapping = field(default_factory=Mapping)
    mapping_file: str = ''
    first: float | None = None
    last: float | None = None


@dataclass
class Imported:
    """What came of it: recordings in the order of time, with the length (s) of each, and what to know.

    `samples` counts messages by topic, of all recordings.
    """

    recordings: list[Path] = field(default_factory=list)
    lengths: list[float] = field(default_factory=list)
    samples: dict[str, int] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)


def import_recording(order: ImportOrder, progress: Progress = lambda share, what: None) -> Imported:
    """Write the recording `order.out`, or one with a number for each part between gaps.

    Raises a `ValueError` or `OSError` with the reason, before anything is written.
    """
    progress(0.0, 'reading')
    files = read_files(order.files, order.mapping)
    signals, notes = join_files([(one.name, one.signals) for one in files])
    notes = [note for one in files for note in one.notes] + notes
    notes += [note for signal in signals.values() for note in signal.notes]
    parts, cuts = parts_of(within(signals, order.first, order.last))
    notes += cuts
    shift = SECOND - parts[0].begin  # a replay dates the force table before the first sample
    if shift > 0:
        parts = [part.later(shift) for part in parts]
        notes.append(f'stamps are those of the file and {shift / SECOND:.3f} s')
    quantities = {name: quantity for one in files for name, quantity in one.quantities.items()}
    files, signals = [replace(one, signals={}) for one in files], {}  # else an hour is held to the end
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
        folder = order.out
        if len(written) > 1:
            folder = folder.with_name(f'{folder.name}_{number + 1}')
        session = _session(order, files, channels, imported.notes, f'{number + 1} of {len(written)}')

        def show(share: float, begun: int = number) -> None:
            progress((begun + share) / len(written), 'writing')

        write_channels(folder, channels, session, show)
        imported.recordings.append(folder)
        for channel in channels:
            topic = f'/{channel.place.topic.name}'
            imported.samples[topic] = imported.samples.get(topic, 0) + int(channel.stamps.size)
    return imported


def _session(
    order: ImportOrder,
    files: Sequence[Selection],
    channels: Sequence[Channel],
    notes: Sequence[str],
    piece: str,
) -> dict[str, Any]:
    places = [(channel.place, channel.unit) for channel in channels]
    imported = {
        'files': [told_provenance(one.provenance) for one in files],
        'piece': piece,
        'mapping': told_mapping(order.mapping, order.mapping_file),
        'columns': {name: told for one in files for name, told in one.columns.items()},
        'topics': {f'/{place.topic.name}': f'{place.field} in {unit}' for place, unit in places},
        'notes': list(notes),
    }
    return new_session({'scenario': SCENARIO, 'mode': 'import', 'imported': imported})
