"""A road from an OpenCRG file or a table of height over distance; whether it is one, and even."""

import hashlib
import re
from pathlib import Path

import numpy as np

from engine_mount.signals.even_grid import interpolated
from engine_mount.signals.formats.measured import Provenance
from engine_mount.signals.formats.reading import read
from engine_mount.signals.mapping import Mapping, with_options
from engine_mount.signals.quantities import Quantity, by_name
from engine_mount.signals.roads.crg import read_track
from engine_mount.signals.roads.iso8608 import RoadProfile, root_mean_square, unevenness
from engine_mount.signals.selection import select_rows
from engine_mount.signals.signal import FloatArray, SignalError
from engine_mount.signals.sources.stores import local_copy
from engine_mount.signals.sources.uris import name_of

EFFECTIVE = 'effective_height'
"""Name of a height that is already the one behind the tyre."""
LONGEST_GAP = 0.5  # m, chosen: 0.03 s at 60 km/h, less than half a period of the engine on its mounts
SHORTEST_ROAD = 5.0  # m, chosen: less holds hardly a wave that the engine feels
SMOOTHEST, ROUGHEST = 5e-5, 0.25
"""m, chosen: rms of waves shorter than 100 m; a tenth of a new motorway's, and class G of ISO 8608."""
_FEWEST = 20  # places
_ON_THE_GRID = 1e-3  # spacings, chosen: as of recorded signals
_WIDE = 1.5  # spacings: a wider step is a gap
_FLAT_SPECTRUM = 0.5  # chosen: waviness below; of roads it is 1.5 to 3.5, of accelerations of a car about 0
_HIGH_STONES = 0.03  # m, chosen: rms up to which a flat spectrum is that of a pavement of stones
_DISTANCE = Quantity(
    'distance', 'length', 'distance along the road',
    titles=(
        'dist', 'x', 's', 'u', 'station', 'chainage', 'position', 'weg', 'strecke', 'wegstrecke', 'laenge',
        'länge',
    ),
)  # fmt: skip
_HEIGHT = Quantity(
    'height', 'length', 'height of the road',
    titles=(EFFECTIVE, 'z', 'h', 'elevation', 'profile', 'road', 'hoehe', 'höhe', 'unevenness', 'unebenheit'),
)  # fmt: skip
_OPTION = '--column {column}:{unit}, of a distance --distance {column}:{unit}'


def road_profile(
    uri: str | Path, *, lateral: float = 0.0, column: str = '', distance: str = ''
) -> RoadProfile:
    """Return the road in the file at `uri`, checked, on an even grid.

    `lateral` (m, left of the reference line) chooses the track of an OpenCRG file; `column` and `distance`,
    NAME or NAME:UNIT, the columns of a table, the distance may be that between two heights (m). Raises
    `SignalError` or `SourceError` with one sentence.
    """
    name = name_of(str(uri))
    if name.lower().endswith('.crg'):
        with local_copy(str(uri)) as path:
            content = path.read_bytes()
        places, heights, notes = read_track(name, content, lateral)
        digest = hashlib.sha256(content).hexdigest()
        provenance = Provenance(str(uri), digest, len(content), 'OpenCRG', 'engine_mount.signals')
        effective = False
    else:
        measured = read(uri)
        provenance, notes = measured.provenance, measured.notes
        spaced = re.fullmatch(r'[\d.]+(e-?\d+)?', distance)
        wanted = by_name(_HEIGHT) if spaced else by_name(_HEIGHT, _DISTANCE)
        said = {'height': column, 'distance': distance}
        texts = [f'{what}={text}' for what, text in said.items() if text and what in wanted]
        mapping = with_options(Mapping(option=_OPTION), texts, known=wanted)
        rows = select_rows(measured, mapping, wanted, wanted)
        heights = rows['height']
        places = float(distance) * np.arange(heights.size) if spaced else rows['distance']
        chosen = mapping.columns['height'].column if column else EFFECTIVE
        effective = chosen == EFFECTIVE and EFFECTIVE in measured.columns
    known = np.flatnonzero(np.isfinite(heights))
    if not known.size:
        raise SignalError(f'{name} holds no height: all {heights.size} are missing')
    if missing := heights.size - 1 - int(known[-1] - known[0]):
        notes = (*notes, f'{missing} missing heights at the ends are left out')
    spacing, even, done = _even_places(name, places[known], heights[known])
    profile = RoadProfile(float(places[known[0]]), spacing, even, provenance, (*notes, *done), effective)
    _check_road(profile)
    return profile


def _check_road(profile: RoadProfile) -> None:
    """Raise `SignalError` for heights in another unit, and for an acceleration in their place."""
    rms = root_mean_square(profile)
    if not SMOOTHEST <= rms <= ROUGHEST:
        what, guess = ('rougher', 'mm instead of m') if rms > ROUGHEST else ('smoother', 'm instead of mm')
        raise SignalError(
            f'{profile.name}: waves up to 100 m have a height of {rms:.3g} m rms, {what} than any road '
            f'({SMOOTHEST:g} .. {ROUGHEST:g} m, chosen); are they in {guess}?'
        )
    waviness = unevenness(profile).waviness
    if waviness < _FLAT_SPECTRUM and rms > _HIGH_STONES:
        raise SignalError(
            f'{profile.name}: a waviness of {waviness:.2f} with {rms:.3g} m rms is not that of heights '
            '(1.5 to 3.5) but of accelerations (about 0); if it is one, drive it with --scenario recorded, '
            'or make a road of it with engine-mount road invert'
        )


def _even_places(name: str, places: FloatArray, heights: FloatArray) -> tuple[float, FloatArray, list[str]]:
    """Return spacing and heights on an even grid from the first place on, and what was done."""
    steps = np.diff(places)
    back = np.flatnonzero(steps <= 0.0)
    if back.size:
        place = int(back[0])
        raise SignalError(
            f'{name}: the distance does not rise at line {place + 1} of the numbers: {places[place]:g} m is '
            f'followed by {places[place + 1]:g} m ({back.size} such); is this column a distance? Cut there, '
            'or sort the lines'
        )
    length = places[-1] - places[0]
    if places.size < _FEWEST or length < SHORTEST_ROAD:
        raise SignalError(
            f'{name}: {places.size} places on {length:g} m; at least {_FEWEST} on {SHORTEST_ROAD:g} m are '
            'needed: is the unit of the distance another one?'
        )
    spacing, longest = float(np.median(steps)), int(steps.argmax())
    wide = np.count_nonzero(steps > _WIDE * spacing)
    if steps[longest] > max(LONGEST_GAP, _WIDE * spacing):
        raise SignalError(
            f'{name}: no heights from {places[longest]:g} to {places[longest + 1]:g} m ({steps[longest]:.3g} '
            f'm; {wide} gaps in all); up to {LONGEST_GAP:g} m are interpolated: cut the road there, or '
            'take another track'
        )
    count = round(length / spacing) + 1 if wide else places.size
    exact = float(length) / (count - 1)
    grid = places[0] + exact * np.arange(count)
    if not wide and np.abs(places - grid).max() <= _ON_THE_GRID * exact:
        return exact, heights, []
    note = f'brought from uneven places onto an even grid of {exact:.4g} m'
    if wide:
        note = f'{wide} gaps are interpolated, the longest of {steps[longest]:.3g} m at {places[longest]:g} m'
    return exact, interpolated(places, heights, grid), [note]
