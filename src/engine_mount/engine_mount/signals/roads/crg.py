"""A track of an OpenCRG file (ASAM OpenCRG 1.2) as height over distance."""

import re
from collections.abc import Callable

import numpy as np

from engine_mount.signals.roads.crg_file import Channel, CrgFile, parse_crg
from engine_mount.signals.roads.profile import FloatArray, ProfileError

_AT = re.compile(r'long section at v\s*=\s*(\S+)$')
_NUMBERED = re.compile(r'long section (\d+)$')
_V_INCREMENT = 0.01  # m: of numbered long sections where the header tells none (OpenCRG)
_SAME = 1e-6  # m
_SCALES = ('scale_z_grid', 'scale_slope', 'scale_banking', 'scale_length', 'scale_width')

Track = tuple[float, float, FloatArray, tuple[str, ...]]
"""First place (m), spacing (m), heights (n,) in m with NaN where the file has none, notes."""


def read_track(
    name: str, content: bytes, lateral: float, beside: Callable[[str], tuple[str, bytes]]
) -> Track:
    """Return the track `lateral` m left of the reference line; raises `ProfileError`.

    `beside` fetches a file that this one refers to: (name, content).
    """
    file = parse_crg(name, content)
    modifiers = file.values('ROAD_CRG_MODS') if 'ROAD_CRG_MODS' in file.sections else None
    if not file.channels:
        name, file = _referred(name, file, beside)
    if modifiers is None:
        modifiers = file.values('ROAD_CRG_MODS')
    scale = {word: modifiers.get(word, 1.0) for word in _SCALES}
    first, increment = _along(name, file)
    lateral_places, columns = _long_sections(name, file)
    grid = scale['scale_z_grid'] * _at(name, lateral, scale['scale_width'] * lateral_places, file, columns)
    slope, banking, notes = _reference_line(file, increment, lateral)
    height = grid + scale['scale_slope'] * slope + scale['scale_banking'] * banking
    _check_rows(name, file, first, increment)
    words = [
        f'track at v = {lateral:g} m of {lateral_places[0]:g} .. {lateral_places[-1]:g} m',
        *notes,
    ]
    words += [f'{word.upper()} {factor:g} is applied' for word, factor in scale.items() if factor != 1.0]
    if set(modifiers) - set(_SCALES):
        words.append(
            f'modifiers that are not applied: {", ".join(sorted(set(modifiers) - set(_SCALES))).upper()}'
        )
    return first, increment * scale['scale_length'], height, tuple(words)


def _referred(name: str, file: CrgFile, beside: Callable[[str], tuple[str, bytes]]) -> tuple[str, CrgFile]:
    reference = ''.join(file.sections.get('ROAD_CRG_FILE', ()))
    if not reference:
        raise ProfileError(
            f'{name} has no table of heights: no $KD_DEFINITION with channels, no line $$$$, no '
            '$ROAD_CRG_FILE'
        )
    if '$' in reference:
        raise ProfileError(f'{name} refers to {reference} by an environment variable; give that file itself')
    inner, content = beside(reference)
    referred = parse_crg(inner, content)
    if not referred.channels:
        raise ProfileError(f'{name} refers to {inner}, which has no table of heights; give the one that has')
    return inner, referred


def _along(name: str, file: CrgFile) -> tuple[float, float]:
    """Return first place and increment (m) of the reference line."""
    road = file.values('ROAD_CRG')
    first, increment = road.get('reference_line_start_u', 0.0), road.get('reference_line_increment')
    for channel in file.virtual:
        if channel.title == 'reference line u' and channel.unit == 'm' and len(channel.numbers) == 2:
            first, increment = channel.numbers
    if increment is None or not increment > 0.0:
        raise ProfileError(
            f'{name}: REFERENCE_LINE_INCREMENT in $ROAD_CRG must be above 0 m; '
            f'instead it is {"missing" if increment is None else increment}'
        )
    return first, increment


def _check_rows(name: str, file: CrgFile, first: float, increment: float) -> None:
    rows, end = len(file.table), file.values('ROAD_CRG').get('reference_line_end_u')
    if end is not None and end > first and rows < round((end - first) / increment) + 1:
        raise ProfileError(
            f'{name}: {rows} rows of {increment:g} m from u = {first:g} m on, but REFERENCE_LINE_END_U is '
            f'{end:g} m; is the file cut off?'
        )


def _long_sections(name: str, file: CrgFile) -> tuple[FloatArray, list[int]]:
    """Return the lateral places (m, rising) of the long sections and their columns."""
    named: dict[float, int] = {}
    numbered: dict[float, int] = {}
    for column, channel in enumerate(file.channels):
        for pattern, found in ((_AT, named), (_NUMBERED, numbered)):
            match = pattern.match(channel.title)
            if match:
                _check_unit(name, channel)
                found[float(match[1])] = column
    if bool(named) == bool(numbered):
        raise ProfileError(
            f'{name}: channels must be long sections, all "at v = X" or all numbered; instead there are '
            f'{", ".join(channel.title for channel in file.channels[:5])} ...'
        )
    if named:
        places = np.array(sorted(named))
        return places, [named[place] for place in places]
    order = sorted(numbered)
    if order != list(range(1, len(order) + 1)):
        raise ProfileError(
            f'{name}: long sections must be numbered 1 .. {len(order)}; instead up to {order[-1]:g}'
        )
    road = file.values('ROAD_CRG')
    right, left = road.get('long_section_v_right'), road.get('long_section_v_left')
    step = road.get('long_section_v_increment')
    if step is None:
        whole = right is not None and left is not None and len(order) > 1
        step = (left - right) / (len(order) - 1) if whole else _V_INCREMENT
    begin = -0.5 * step * (len(order) - 1) if right is None else right
    return begin + step * np.arange(len(order)), [numbered[number] for number in order]


def _check_unit(name: str, channel: Channel) -> None:
    if channel.unit != 'm':
        raise ProfileError(
            f'{name}: channel {channel.title!r} is in {channel.unit or "no unit"}; OpenCRG gives heights in '
            'm: is it a road, or friction or colour of one?'
        )


def _at(name: str, lateral: float, places: FloatArray, file: CrgFile, columns: list[int]) -> FloatArray:
    """Return the heights (n,) at a lateral place, between two sections linear as OpenCRG evaluates them."""
    if not places[0] - _SAME <= lateral <= places[-1] + _SAME:
        raise ProfileError(
            f'{name}: no track at v = {lateral:g} m; its long sections are at {places[0]:g} .. '
            f'{places[-1]:g} m: choose one with --lateral'
        )
    exact = np.flatnonzero(np.abs(places - lateral) <= _SAME)
    if exact.size:
        return file.table[:, columns[exact[0]]]
    right = int(np.searchsorted(places, lateral)) - 1
    share = (lateral - places[right]) / (places[right + 1] - places[right])
    return (1.0 - share) * file.table[:, columns[right]] + share * file.table[:, columns[right + 1]]


def _reference_line(
    file: CrgFile, increment: float, lateral: float
) -> tuple[FloatArray, FloatArray, list[str]]:
    """Return what slope and banking add to the heights, (n,) each, and notes.

    The slope in a row holds from the row before on, that in the first row is unused; banking holds in its
    row.
    """
    rows, notes = len(file.table), []
    titles = [channel.title for channel in file.channels]
    road = file.values('ROAD_CRG')

    def column(word: str, constant: str) -> FloatArray:
        if f'reference line {word}' in titles:
            return np.nan_to_num(file.table[:, titles.index(f'reference line {word}')])
        return np.full(rows, road.get(constant, 0.0))

    slope, banking = column('slope', 'reference_line_start_s'), column('banking', 'reference_line_start_b')
    slope[:1] = 0.0
    if slope.any():
        notes.append(f'slope of the reference line, up to {np.abs(slope).max():.3g} m/m, is in the heights')
    if banking.any():
        notes.append(f'banking, up to {np.abs(banking).max():.3g} m/m, lifts this track with v')
    if 'reference line phi' in titles:
        notes.append('the heading is ignored: distances are those along the reference line')
    return increment * np.cumsum(slope), lateral * banking, notes
