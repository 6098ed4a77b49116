"""What is said of single rack recordings: by the caller, by their names, and whether they can be taken."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from engine_mount.identification.rack.columns import RackRecordingError
from engine_mount.recordings.place import open_run, recording_hash, recording_place
from engine_mount.recordings.recording import Recording
from engine_mount.signals.formats.bag import is_recording
from mount_ros.topics import COIL_RIPPLE

FEWEST = 8  # chosen: fewer points are no measurement
_GAP_IN_NAME = re.compile(r'(?<![\d.])(\d+(?:\.\d+)?)um(?![a-z])', re.IGNORECASE)
_CELSIUS_IN_NAME = re.compile(r'([+-]?\d+(?:\.\d+)?)degC', re.IGNORECASE)


@dataclass(frozen=True)
class GivenValues:
    """What the caller says of single files, by their names as given: gap (m), coil temperature (degC)."""

    gap: Mapping[Path, float]
    celsius: Mapping[Path, float]
    celsius_of_others: float | None = None


def described(files: Sequence[Path]) -> list[dict[str, str]]:
    """Return name and SHA-256 of each recording; of a folder, that of its files one after the other."""
    return [{'file': file.name, 'sha256': recording_hash(file)} for file in files]


def checked_files(files: Sequence[Path]) -> Sequence[Path]:
    """Return the files, each of which must be there, and none twice; raises `RackRecordingError`."""
    seen: dict[str, Path] = {}
    for file in files:
        if not file.exists():
            raise RackRecordingError(f'{file} does not exist; give files of measured columns, or recordings')
        digest = recording_hash(file)
        if digest in seen:
            raise RackRecordingError(
                f'{file} and {seen[digest]} are the same to the bit; give each recording once'
            )
        seen[digest] = file
    return files


def is_table(file: Path) -> bool:
    """Return whether a file holds columns: no recording of this project, whose topics tell what is what."""
    return not is_recording(recording_place(file)) or COIL_RIPPLE.name not in open_run(file)


def gap_of(file: Path, given: Mapping[Path, float]) -> float:
    """Return the gap (m) by option or by name; raises `RackRecordingError` without either."""
    if file in given:
        return given[file]
    named = _GAP_IN_NAME.search(_bare_name(file))
    if named is None:
        kind = '' if file.is_dir() else file.suffix
        raise RackRecordingError(
            f'{file}: its air gap is not known; add --gap {file.name}=UM, a column gap_um, or the gap to its '
            f'name, as in ripple_349um{kind}'
        )
    return float(named[1]) * 1e-6


def _bare_name(file: Path) -> str:
    """Return the name without the kind of file; a folder's has none, whatever stands behind its last dot."""
    return file.name if file.is_dir() else file.stem


def celsius_of(file: Path, given: GivenValues) -> float:
    """Return the coil's temperature (degC) by option or name; raises `RackRecordingError` without either."""
    if file in given.celsius:
        return given.celsius[file]
    named = _CELSIUS_IN_NAME.search(_bare_name(file))
    if named is not None:
        return float(named[1])
    if given.celsius_of_others is None:
        raise RackRecordingError(
            f'{file}: the temperature of its coil is not known; add --coil-temperature DEGC for all files, '
            f'{file.name}=DEGC for this one, or a column coil_temperature_c'
        )
    return given.celsius_of_others


def topic_in(recording: Recording, name: str) -> Any:
    """Return the messages of a topic; raises `RackRecordingError` where there are none."""
    if name not in recording:
        raise RackRecordingError(
            f'{recording.path} has no topic {name}; it holds {", ".join(sorted(recording)) or "none"}: is it '
            'a recording of the rack?'
        )
    return recording[name]
