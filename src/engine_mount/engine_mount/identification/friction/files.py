"""Friction recordings from files of any format that is read here, and from recordings in topics.

Units end here: everything behind is in SI units.
"""

from pathlib import Path

from engine_mount.identification.friction.channels import DESIRED, FRICTION, NEEDED, friction_mapping
from engine_mount.identification.friction.damper_file import is_damper, read_damper
from engine_mount.identification.friction.recording import (
    FrictionRecording,
    IdentificationError,
    checked_recording,
)
from engine_mount.recordings.place import recording_place
from engine_mount.signals.mapping import Mapping
from engine_mount.signals.selection import select_rows


def read_recording(path: Path, mapping: Mapping | None = None, clamp: str = 'sliding') -> FrictionRecording:
    """Return the checked recording in `path`; `mapping` names columns or fields, `clamp` see `read_damper`.

    Raises `IdentificationError` and the readers' errors.
    """
    mapping = mapping or friction_mapping()
    if not path.exists():
        raise IdentificationError(
            f'{path} does not exist; give a file of measured columns, or a recording or its folder'
        )
    if path.suffix.lower() == '.json' and is_damper(path):
        return read_damper(path, mapping, clamp)
    columns = select_rows(recording_place(path), mapping, FRICTION, NEEDED, timed=True)
    return checked_recording(
        path.name, columns['time'], columns['displacement'], columns['friction_force'],
        columns['normal_force'], columns.get(DESIRED),
    )  # fmt: skip
