"""Foreign files in a fleet: which mapping is theirs, and the recording that is made of one for a while."""

import contextlib
import hashlib
import json
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from engine_mount.recordings.place import open_run
from engine_mount.recordings.recording import Recording
from engine_mount.signals.formats.content import Stated
from engine_mount.signals.formats.measured import Heading, listed
from engine_mount.signals.formats.reading import headings, is_foreign
from engine_mount.signals.importing.channels import CHASSIS, DISPLACEMENT, ENGINE
from engine_mount.signals.importing.reading import part_in, told_by_titles
from engine_mount.signals.mapping import ColumnChoice, Mapping, mapping_in_file, with_options
from engine_mount.signals.signal import SignalError

ACCELERATION = 'acceleration'
_OPTION = '{quantity}: {{column: {column}, unit: {unit}}} into its mapping file (--map)'
"""How a mapping file says a column, for remedies."""


@dataclass(frozen=True)
class Said:
    """What is said of foreign files: mappings by the names of their files, and the DBC of CAN logs."""

    mappings: tuple[tuple[str, Mapping], ...] = ()
    dbc: Path | None = None

    @property
    def is_known(self) -> bool:
        """Whether anything is said: then all files of a known format are looked at."""
        return bool(self.mappings)

    @property
    def told(self) -> dict[str, Any]:
        """What makes two of them the same, as plain data; {} where nothing is said."""
        if not self.mappings and self.dbc is None:
            return {}
        plain = {
            'mapping_files': [name for name, _ in self.mappings],
            'mappings': [asdict(mapping) for _, mapping in self.mappings],
            'dbc': self.dbc,
            'dbc_sha256': self.dbc and hashlib.sha256(self.dbc.read_bytes()).hexdigest(),
        }
        return dict(json.loads(json.dumps(plain, default=str)))

    @property
    def mark(self) -> str:
        """A short text that is another one where anything else is said."""
        return f'-{hashlib.sha256(json.dumps(self.told, sort_keys=True).encode()).hexdigest()[:8]}'


NOTHING_SAID = Said()


def said_in(mapping_files: Sequence[Path], dbc: Path | None = None) -> Said:
    """Return what mapping files and a DBC say; raises `SignalError`, or `OSError` for a DBC not there."""
    if dbc is not None:
        dbc = dbc.absolute()
        dbc.open('rb').close()
    found = {str(file.absolute()): mapping_in_file(file) for file in mapping_files}
    return Said(tuple((file, _complete(mapping, dbc)) for file, mapping in found.items()), dbc)


@dataclass(frozen=True)
class Mapped:
    """A foreign file with its mapping; `file` is where that was read, '' where titles told it."""

    path: Path
    file: str
    mapping: Mapping

    @property
    def told(self) -> dict[str, str]:
        """What a row tells of it."""
        columns = {name: choice.column for name, choice in self.mapping.columns.items()}
        return {'mapping_file': self.file, 'mapped': json.dumps(columns, ensure_ascii=False)}

    def motion(self) -> dict[str, ColumnChoice]:
        """Return the columns of the displacement, or of engine and chassis; {} where it is not mapped."""
        both = self.of(ENGINE, CHASSIS)
        return self.of(DISPLACEMENT) or (both if len(both) > 1 else {})

    def of(self, *names: str) -> dict[str, ColumnChoice]:
        """Return the columns of these quantities that are mapped."""
        return {name: self.mapping.columns[name] for name in names if name in self.mapping.columns}


def own_recording(path: Path, said: Said) -> Recording | None:
    """Return the recording of this project at `path`, None for what is read by a mapping.

    That is a foreign file, or a bag with what a mapping file names and without the displacement of a mount.
    Raises `ReadingError` for a recording of which nothing is readable.
    """
    if is_foreign(path):
        return None
    recording = open_run(path)
    if recording.mounts or not said.mappings:
        return recording
    try:
        mapped_in(path, said)
    except ValueError:
        return recording
    return None


def columns_in(path: Path, said: Said) -> tuple[Heading, ...]:
    """Return the columns of a file, of a text table as the first mapping that can reads it.

    Raises a `ValueError`.
    """
    *others, last = dict.fromkeys(mapping.stated for _, mapping in said.mappings) or (Stated(dbc=said.dbc),)
    for stated in others:
        with contextlib.suppress(ValueError):
            return headings(path, stated)
    return headings(path, last)


def mapped_in(path: Path, said: Said) -> Mapped:
    """Return a file with the mapping that names most of its columns, the first among equals.

    Without mapping files its titles and units tell. Raises a `ValueError` where nothing is told.
    """
    there = columns_in(path, said)
    if not said.mappings:
        return Mapped(path, '', told_by_titles({path.name: there}, _complete(Mapping(), said.dbc)))
    found = [Mapped(path, file, part_in(mapping, there)) for file, mapping in said.mappings]
    most = max(found, key=lambda one: len(one.mapping.columns))
    if not most.mapping.columns:
        files = ', '.join(Path(file).name for file, _ in said.mappings)
        raise SignalError(f'{path.name} has no column that {files} names; its columns are {listed(there)}')
    return most


@contextlib.contextmanager
def as_recording(mapped: Mapped, *, closed_loop: bool) -> Iterator[Path]:
    """Give what a replay needs of a foreign file as a recording, for as long as the block lasts.

    That is the displacement, in a closed loop the acceleration of the chassis. Raises a `ValueError`.
    """
    from engine_mount.signals.importing.importing import ImportOrder, import_recording  # loads the simulator

    columns = mapped.of(ACCELERATION) if closed_loop else mapped.motion()
    name = mapped.path.name
    if not columns:
        wanted = (
            'acceleration of the chassis, which --closed-loop drives over'
            if closed_loop
            else 'displacement (nor as engine_displacement and chassis_displacement), which setpoints answer'
        )
        there = ', '.join(mapped.mapping.columns)
        raise SignalError(f'{name}: no column is mapped as {wanted}; mapped are {there}')
    with tempfile.TemporaryDirectory(prefix='engine_mount_fleet_') as folder:
        order = ImportOrder([str(mapped.path)], Path(folder) / 'recording', mapped.mapping.only(columns))
        imported = import_recording(order)
        if len(imported.recordings) > 1:
            gap = next(note for note in imported.notes if note.startswith('a gap of'))
            raise SignalError(
                f'{name}: {gap.partition(":")[0]}; engine-mount import makes recordings of its '
                f'{len(imported.recordings)} parts'
            )
        yield imported.recordings[0]


def _complete(mapping: Mapping, dbc: Path | None) -> Mapping:
    return with_options(replace(mapping, option=_OPTION), stated=Stated(dbc=dbc))
