"""Heights at rising places brought onto an even grid; what is missing is mended where it is short."""

from typing import NamedTuple

import numpy as np

from engine_mount.signals.even_grid import interpolated
from engine_mount.signals.roads.profile import FloatArray, ProfileError

LONGEST_GAP = 0.5  # m, chosen: 0.03 s at 60 km/h, less than half a period of the engine on its mounts
SHORTEST_ROAD = 5.0  # m, chosen: less holds hardly a wave that the engine feels
_FEWEST = 20  # places
_ON_THE_GRID = 1e-3  # spacings, chosen: as of recorded signals
_WIDE = 1.5  # spacings: a wider step is a gap


class EvenPlaces(NamedTuple):
    """First place (m), spacing (m), heights (n,) in m, and what was done to get them."""

    first: float
    spacing: float
    height: FloatArray
    notes: tuple[str, ...]


def even_places(name: str, distance: FloatArray, height: FloatArray) -> EvenPlaces:
    """Return heights (n,) in m at distances (n,) in m on an even grid; raises `ProfileError`."""
    _check_numbers(name, distance)
    known = np.isfinite(height)
    if not known.any():
        raise ProfileError(f'{name} holds no height: all {height.size} are missing')
    first, last = (int(place) for place in np.flatnonzero(known)[[0, -1]])
    notes = []
    if first or last < height.size - 1:
        notes.append(
            f'{first + height.size - 1 - last} missing heights at the ends are left out: from '
            f'{distance[first]:g} to {distance[last]:g} m'
        )
    inner = slice(first, last + 1)
    places, heights = distance[inner][known[inner]], height[inner][known[inner]]
    places, heights, again = _rising(name, places, heights)
    notes += again
    _check_length(name, places)
    spacing = float(np.median(np.diff(places)))
    gaps = _gaps(name, places, spacing)
    count = round((places[-1] - places[0]) / spacing) + 1 if gaps else places.size
    exact = (places[-1] - places[0]) / (count - 1)
    grid = places[0] + exact * np.arange(count)
    if not gaps and np.abs(places - grid).max() <= _ON_THE_GRID * exact:
        return EvenPlaces(float(places[0]), float(exact), heights, tuple(notes))
    notes += gaps or [f'brought from uneven places onto an even grid of {exact:.4g} m']
    return EvenPlaces(float(places[0]), float(exact), interpolated(places, heights, grid), tuple(notes))


def _check_numbers(name: str, distance: FloatArray) -> None:
    bad = np.flatnonzero(~np.isfinite(distance))
    if bad.size:
        raise ProfileError(
            f'{name}: distance number {bad[0]} is {distance[bad[0]]} ({bad.size} such of {distance.size}); '
            'remove these lines'
        )


def _rising(name: str, places: FloatArray, heights: FloatArray) -> tuple[FloatArray, FloatArray, list[str]]:
    """Return places and heights, once where the car stood; refuse distances that go back."""
    steps = np.diff(places)
    back = np.flatnonzero(steps < 0.0)
    if back.size == steps.size and steps.size:
        return places[::-1], heights[::-1], ['distances fall: the road is driven from its other end']
    if back.size:
        place = int(back[0])
        raise ProfileError(
            f'{name}: the distance does not rise at line {place + 1} of the numbers: {places[place]:g} m is '
            f'followed by {places[place + 1]:g} m ({back.size} such); is this column a distance? Cut there, '
            'or sort the lines'
        )
    if not np.any(steps == 0.0):
        return places, heights, []
    once, group = np.unique(places, return_inverse=True)
    mean = np.bincount(group, heights) / np.bincount(group)
    return (
        once,
        mean,
        [f'{places.size - once.size} heights at a place that was there already are averaged with it'],
    )


def _check_length(name: str, places: FloatArray) -> None:
    length = places[-1] - places[0] if places.size else 0.0
    if places.size < _FEWEST or length < SHORTEST_ROAD:
        guess = (
            '; are the distances in km?' if places.size >= _FEWEST and 1000 * length >= SHORTEST_ROAD else ''
        )
        raise ProfileError(
            f'{name}: {places.size} places on {length:g} m; at least {_FEWEST} on {SHORTEST_ROAD:g} m are '
            f'needed{guess}'
        )


def _gaps(name: str, places: FloatArray, spacing: float) -> list[str]:
    steps = np.diff(places)
    wide = np.flatnonzero(steps > _WIDE * spacing)
    if not wide.size:
        return []
    longest = int(steps.argmax())
    if steps[longest] > max(LONGEST_GAP, _WIDE * spacing):
        raise ProfileError(
            f'{name}: no heights from {places[longest]:g} to {places[longest + 1]:g} m ({steps[longest]:.3g} '
            f'm; {wide.size} gaps in all); up to {LONGEST_GAP:g} m are interpolated: cut the road there, or '
            'take another track'
        )
    return [
        f'{wide.size} gaps are interpolated, the longest of {steps[longest]:.3g} m at {places[longest]:g} m'
    ]
