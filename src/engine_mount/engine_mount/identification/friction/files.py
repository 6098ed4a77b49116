"""Friction recordings from files of any format that is read here, and from recordings in topics.

Units end here: everything behind is in SI units.
"""

from dataclasses import replace
from pathlib import Path

from engine_mount.identification.friction.channels import DESIRED, NEEDED, Channel, Said, columns_in_si
from engine_mount.identification.friction.damper_file import is_damper, read_damper
from engine_mount.identification.friction.recording import (
    FrictionRecording,
    IdentificationError,
    checked_recording,
)
from engine_mount.identification.rack.measured_table import MeasuredTable, in_topics

TOPICS = {
    'displacement': ('displacement', 'mount'),
    'friction_force': ('sim/mount_force', 'wrench.force.z'),
    'normal_force': ('sim/clamp_force', 'wrench.force.z'),
}
"""Topic and field of each quantity in recordings of this project."""


def read_recording(path: Path, said: Said | None = None, clamp: str = 'sliding') -> FrictionRecording:
    """Return the checked recording in `path`; `said` names columns or fields, `clamp` see `read_damper`.

    Raises `IdentificationError` and the readers' errors.
    """
    said = said or Said()
    if not path.exists():
        raise IdentificationError(
            f'{path} does not exist; give a file of measured columns, or a recording or its folder'
        )
    if path.suffix.lower() == '.json' and is_damper(path):
        return read_damper(path, said, clamp)
    table = MeasuredTable(path, said.stated)
    columns = columns_in_si(table, _with_own(table, said) if in_topics(path) else said, NEEDED)
    return checked_recording(
        table.path.name, columns['time'], columns['displacement'], columns['friction_force'],
        columns['normal_force'], columns.get(DESIRED),
    )  # fmt: skip


def _with_own(table: MeasuredTable, said: Said) -> Said:
    """Return what is said of a recording in topics, with the fields that one of this project has."""
    own = {name: f'{topic}.{field}' for name, (topic, field) in TOPICS.items()}
    there = {
        name: Channel(source)
        for name, source in own.items()
        if any(f'/{heading}'.endswith(f'/{source}') for heading in table.names)
    }
    return replace(said, channels={**there, **said.channels})
