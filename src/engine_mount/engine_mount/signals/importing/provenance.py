"""Where a recording made of files of others came from, as plain data for its session."""

from collections.abc import Mapping as Keys
from dataclasses import asdict
from pathlib import PurePosixPath
from typing import Any

from engine_mount.signals.formats.measured import Measured, Provenance
from engine_mount.signals.sources.uris import is_uri, shown
from engine_mount.signals.units.columns import name_of
from engine_mount.signals.units.mapping import Mapping
from engine_mount.signals.units.signals import ChosenSignal

Told = dict[str, Any]

SCENARIO = 'imported'
"""The scenario of such a recording, as its session tells it."""


def told_source(measured: Measured) -> Told:
    """Return what a session says of a file: its name, URI where it has one, hash, size, format, reader."""
    return told_provenance(measured.provenance)


def told_provenance(came: Provenance) -> Told:
    """Return the same of what a file was, without its content."""
    told: Told = {'file': name_of(came.uri)}
    if is_uri(came.uri) and not came.uri.startswith('file:'):
        told['uri'] = shown(came.uri)
    told |= {'sha256': came.sha256, 'bytes': came.size, 'format': came.format, 'reader': came.reader}
    return told


def told_columns(chosen: Keys[str, ChosenSignal]) -> Told:
    """Return what a session says of each quantity: its column, unit, factor to SI, and times."""
    return {name: _told_column(one) for name, one in chosen.items()}


def told_mapping(mapping: Mapping, file: str = '') -> Told:
    """Return what a session says of the mapping: the file, the measuring system, times that were said."""
    told: Told = {'file': PurePosixPath(file).name} if file else {}
    if mapping.system:
        told['system'] = mapping.system
    said = {name: value for name, value in asdict(mapping.time).items() if value}
    return {**told, **({'time': said} if said else {})}


def _told_column(one: ChosenSignal) -> Told:
    told: Told = {
        'column': one.signal.name,
        'unit': one.unit.symbol,
        'factor': one.factor,
        'to': one.quantity.unit.symbol,
        'times': one.signal.clock,
        'samples': int(one.signal.values.size),
    }
    return {**told, **({'offset': one.offset} if one.offset else {})}
