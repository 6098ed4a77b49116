"""Where a recording made of files of others came from, as plain data for its session."""

from dataclasses import asdict
from pathlib import PurePosixPath
from typing import Any

from engine_mount.signals.formats.measured import Provenance
from engine_mount.signals.mapping import Mapping
from engine_mount.signals.selection import name_of
from engine_mount.signals.sources.uris import is_uri, shown

Told = dict[str, Any]

SCENARIO = 'imported'
"""The scenario of such a recording, as its session tells it."""


def told_provenance(came: Provenance) -> Told:
    """Return what a session says of a file: its name, URI where it has one, hash, size, format, reader."""
    told: Told = {'file': name_of(came.uri)}
    if is_uri(came.uri) and not came.uri.startswith('file:'):
        told['uri'] = shown(came.uri)
    told |= {'sha256': came.sha256, 'bytes': came.size, 'format': came.format, 'reader': came.reader}
    return told


def told_mapping(mapping: Mapping, file: str = '') -> Told:
    """Return what a session says of the mapping: the file, the measuring system, times that were said."""
    told: Told = {'file': PurePosixPath(file).name} if file else {}
    if mapping.system:
        told['system'] = mapping.system
    said = {name: value for name, value in asdict(mapping.time).items() if value}
    return {**told, **({'time': said} if said else {})}
