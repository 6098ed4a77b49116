"""LabVIEW measurements (.lvm): text tables with a header, X columns and a column of comments.

Keys and meaning: National Instruments, "Specification for the LabVIEW Measurement File (.lvm)".
"""

from bisect import bisect
from collections.abc import Mapping, Sequence
from functools import cache, partial

import numpy as np

from engine_mount.signals.formats.content import Leaf
from engine_mount.signals.formats.measured import TimeBase
from engine_mount.signals.signal import FloatArray

Header = Mapping[str, list[str]]
"""Cells behind each key of the header, those of the channels in their order."""
_FIRST, _END = 'LabVIEW Measurement', '***End_of_Header***'


def take_header(head: list[str]) -> Header:
    """Return the header of a measurement, empty for other tables; removes the title `Comment` from `head`."""
    ends = [number for number, line in enumerate(head[:-1], 1) if line.startswith(_END)]
    if not ends or not head[0].startswith(_FIRST):
        return {}
    separator = '\t' if '\t' in head[1] else ','
    head[ends[-1]] = head[ends[-1]].rstrip().removesuffix('Comment').rstrip(separator)
    rows = (line.rstrip().split(separator) for line in head[: ends[-1]])
    return {'Separator': [separator]} | {key: cells for key, *cells in rows if key != 'Separator'}


def x_places(header: Header, width: int) -> list[int]:
    """Return the places of the X columns among `width` columns."""
    return {'One': [0], 'Multi': list(range(0, width, 2))}.get(header.get('X_Columns', ['No'])[0], [])


def on_own_times(leaves: Sequence[Leaf], header: Header) -> list[Leaf]:
    """Return the channels with units and times: of the nearest X column to the left, else by `Delta_X`."""

    def samples(place: int, x: int) -> FloatArray:
        return _values(leaves[place])[~np.isnan(_values(leaves[x]))]

    @cache
    def clock(x: int) -> TimeBase:
        return TimeBase(samples(x, x), 0, 'its X column')

    def even(channel: int, place: int) -> TimeBase:
        start, step = (float(header[key][channel].replace(',', '.')) for key in ('X0', 'Delta_X'))
        count = _values(leaves[place]).size
        return TimeBase(start + step * np.arange(count), 0, 'X0 and Delta_X of its header')

    places, units, found = x_places(header, len(leaves)), header.get('Y_Unit_Label', []), list(leaves)
    channels = [place for place in range(1, len(leaves)) if place not in places]
    for channel, place in enumerate(channels if header.get('X_Dimension', ['Time'])[0] == 'Time' else ()):
        leaf = leaves[place]._replace(unit=(units[channel:] or [''])[0] or leaves[place].unit)
        if places:
            x = places[bisect(places, place) - 1]
            found[place] = leaf._replace(read=partial(samples, place, x), clock=partial(clock, x))
        else:
            found[place] = leaf._replace(clock=partial(even, channel, place))
    return found


def _values(leaf: Leaf) -> FloatArray:
    return leaf.read() if leaf.read else np.zeros(0)
