"""A road from a file of any format: OpenCRG, or any table with height and distance."""

import hashlib
import math
from pathlib import Path

import numpy as np

from engine_mount.signals.formats.measured import Provenance
from engine_mount.signals.formats.reading import read
from engine_mount.signals.roads import crg
from engine_mount.signals.roads.even_places import even_places
from engine_mount.signals.roads.iso8608 import unevenness
from engine_mount.signals.roads.plausibility import check_displacement, check_heights
from engine_mount.signals.roads.profile import FloatArray, ProfileError, RoadProfile
from engine_mount.signals.roads.table import heights_of
from engine_mount.signals.sources.stores import local_copy

_CRG = '.crg'


def road_profile(
    uri: str | Path,
    *,
    lateral: float = 0.0,
    column: str = '',
    distance: str = '',
    spacing: float = math.nan,
) -> RoadProfile:
    """Return the road in the file at `uri`, checked, on an even grid.

    `lateral` (m, left of the reference line) chooses the track of an OpenCRG file; `column` and `distance`,
    NAME or NAME:UNIT, the columns of a table, `spacing` (m) stands in for a distance. Raises `ProfileError`,
    `SignalError` or `SourceError` with one sentence.
    """
    if str(uri).lower().endswith(_CRG):
        return _of_crg(str(uri), lateral)
    measured = read(uri)
    along, heights, unit, size, effective = heights_of(measured, column, distance, spacing)
    return checked_profile(
        along, heights, measured.provenance, measured.notes, unit=unit, size=size, effective=effective
    )


def checked_profile(
    distance: FloatArray,
    height: FloatArray,
    provenance: Provenance,
    notes: tuple[str, ...] = (),
    *,
    unit: str = 'm',
    size: float = 1.0,
    effective: bool = False,
) -> RoadProfile:
    """Return heights (n,) in m at distances (n,) in m as a road; raises `ProfileError` where they are none.

    `unit` and its `size` in m are those that the file was taken to have, for the guess in a refusal.
    """
    name = provenance.uri.rpartition('/')[2]
    even = even_places(name, distance, height)
    profile = RoadProfile(even.first, even.spacing, even.height, provenance, (*notes, *even.notes), effective)
    check_heights(profile, unit, size)
    check_displacement(profile, unevenness(profile))
    return profile


def _of_crg(uri: str, lateral: float) -> RoadProfile:
    folder, slash, name = uri.rpartition('/')
    content = _content(uri)

    def beside(reference: str) -> tuple[str, bytes]:
        return reference.rpartition('/')[2], _content(f'{folder}{slash}{reference}')

    first, increment, height, notes = crg.read_track(name, content, lateral, beside)
    provenance = Provenance(
        uri, hashlib.sha256(content).hexdigest(), len(content), 'OpenCRG', 'engine_mount.signals'
    )
    along = first + increment * np.arange(height.size)
    return checked_profile(along, height, provenance, notes)


def _content(uri: str) -> bytes:
    with local_copy(uri) as path:
        try:
            return path.read_bytes()
        except OSError as error:
            raise ProfileError(f'{uri} cannot be read: {error.strerror}') from None
