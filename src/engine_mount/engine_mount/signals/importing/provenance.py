"""Where a recording made of a foreign file came from, as plain data for its session."""

from dataclasses import asdict
from pathlib import PurePosixPath
from typing import Any

from engine_mount.signals.formats.measured import Provenance
from engine_mount.signals.mapping import Mapping
from engine_mount.signals.sources.uris import is_local, name_of, shown

Told = dict[str, Any]

SCENARIO = 'imported'
"""The scenario of such a recording, as its session tells it."""


def told_provenance(came: Provenance) -> Told:
    """Return what a session says of a file: its name, URI where it has one, hash, size, format, reader."""
    uri = {} if is_local(came.uri) else {'uri': shown(came.uri)}
    own = {'sha256': came.sha256, 'bytes': came.size, 'format': came.format, 'reader': came.reader}
    return {'file': name_of(came.uri), **uri, **own}


def told_mapping(mapping: Mapping, file: str = '') -> Told:
    """Return what a session says of the mapping: the file, the measuring system, times that were said."""
    times = {name: value for name, value in asdict(mapping.time).items() if value}
    told = {'file': PurePosixPath(file).name, 'system': mapping.system, 'time': times}
    return {name: value for name, value in told.items() if value}
