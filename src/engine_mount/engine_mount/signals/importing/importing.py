"""Files of others made into recordings that every command takes."""

from collections.abc import Callable, Sequence
from collections.abc import Mapping as Keys
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from engine_mount.signals.importing.channels import channels_of
from engine_mount.signals.importing.joined import joined
from engine_mount.signals.importing.pieces import Piece, pieces, within
from engine_mount.signals.importing.provenance import SCENARIO, told_mapping, told_provenance
from engine_mount.signals.importing.reading import read_files
from engine_mount.signals.importing.writing import Channel, write_channels
from engine_mount.signals.mapping import Mapping
from engine_mount.signals.selection import Selection
from engine_mount.signals.signal import SECOND, Signal
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
    signals, notes = joined([(one.name, one.signals) for one in files])
    notes = [note for one in files for note in one.notes] + notes
    imported = Imported(notes=[*notes, *_notes_of(signals)])
    parts, cuts = pieces(within(signals, order.first, order.last))
    parts, shifted = _with_room_before(parts)
    imported.notes += [*cuts, *shifted]
    quantities = {name: quantity for one in files for name, quantity in one.quantities.items()}
    files, signals = [replace(one, signals={}) for one in files], {}  # else an hour is held to the end
    written = []
    while parts:
        part = parts.pop(0)
        channels, done = channels_of(part.signals, quantities)
        imported.notes += [note for note in done if note not in imported.notes]
        written.append((channels, (part.end - part.begin) / SECOND))
    del part
    for number, (channels, length) in enumerate(written):
        folder = _place(order.out, number, len(written))
        session = _session(order, files, channels, imported.notes, f'{number + 1} of {len(written)}')

        def show(share: float, begun: int = number) -> None:
            progress((begun + share) / len(written), 'writing')

        write_channels(folder, channels, session, show)
        _count(imported, folder, length, channels)
    return imported


def _place(out: Path, number: int, count: int) -> Path:
    return out if count == 1 else out.with_name(f'{out.name}_{number + 1}')


def _count(imported: Imported, folder: Path, length: float, channels: Sequence[Channel]) -> None:
    imported.recordings.append(folder)
    imported.lengths.append(length)
    for channel in channels:
        topic = f'/{channel.place.topic.name}'
        imported.samples[topic] = imported.samples.get(topic, 0) + int(channel.stamps.size)


def _notes_of(signals: Keys[str, Signal]) -> list[str]:
    return list(dict.fromkeys(note for signal in signals.values() for note in signal.notes))


def _with_room_before(parts: Sequence[Piece]) -> tuple[list[Piece], list[str]]:
    """Return the parts from 1 s on where they begin earlier: a replay dates the force table before them."""
    shift = SECOND - min(part.begin for part in parts)
    if shift <= 0:
        return list(parts), []
    moved = [
        Piece(
            part.begin + shift,
            part.end + shift,
            {name: replace(signal, begin=signal.begin + shift) for name, signal in part.signals.items()},
        )
        for part in parts
    ]
    return moved, [f'stamps are those of the file and {shift / SECOND:.3f} s']


def _session(
    order: ImportOrder,
    files: Sequence[Selection],
    channels: Sequence[Channel],
    notes: Sequence[str],
    piece: str,
) -> dict[str, Any]:
    columns = {name: told for one in files for name, told in one.columns.items()}
    return new_session(
        {
            'scenario': SCENARIO,
            'mode': 'import',
            'imported': {
                'files': [told_provenance(one.provenance) for one in files],
                'piece': piece,
                'mapping': told_mapping(order.mapping, order.mapping_file),
                'columns': columns,
                'topics': {
                    f'/{channel.place.topic.name}': f'{channel.place.field} in {channel.unit}'
                    for channel in channels
                },
                'notes': list(notes),
            },
        }
    )
