"""A closer look at one recording of a fleet: where the change made the largest difference."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from engine_mount.reports.drawing.chart import DASHED, Array, Chart, Curve, Dots, Panel
from engine_mount.reports.drawing.style import COLOUR_OF, COLOURS, DIFFERENCE_COLOUR, LEVEL_COLOUR
from engine_mount.reports.fleet.readable import handy_unit, quantity
from engine_mount.reports.sections.section import Section

AROUND = 1.0
"""s, chosen: what is there before and after the largest difference."""
AT_FIRST = 0.4
"""s, chosen: what of it is seen at first."""
_MM = 1e3


class Signals(NamedTuple):
    """Signals (n,) over `time` (s); pairs are as recorded and with the change.

    `given`: the recorded displacement (m), to which the controllers answered the `setpoints` (A); where there
    are `displacements` (m), which were simulated, the recorded acceleration (m/s^2) over which they were.
    """

    time: Array
    given: Array
    setpoints: tuple[Array, Array]
    displacements: tuple[Array, Array] | None = None


@dataclass(frozen=True)
class Look:
    """One recording: its row, the commands that open it, its signals, or the `reason` why there are none."""

    row: Mapping[str, Any]
    commands: Sequence[str] = ()
    signals: Signals | None = None
    reason: str = ''

    @property
    def name(self) -> str:
        """The recording, and which of its mounts."""
        return ' '.join(filter(None, (self.row['recording'], self.row['mount'])))


def look_section(number: int, look: Look) -> Section:
    """Return the section about the recording at place `number` (1: the first) of the worst."""
    title, name = f'{number}. {look.name}', f'look_{number}'
    largest = []
    for what, unit in (('displacement', 'm'), ('setpoint', 'A')):
        value = look.row.get(f'{what}_difference_largest_{unit.lower()}')
        place = look.row.get(f'{what}_difference_largest_at_s')
        if value is not None:
            at = '' if place is None else f' at {place:.3f} s'
            largest.append(f'{what} {quantity(value, unit, signed=True)}{at}')
    words = [f'Largest difference, changed minus as recorded: {"; ".join(largest)}.'] if largest else []
    if look.signals is None:
        words.append(f'No picture: {look.reason}')
    chart = None if look.signals is None else _chart(name, title, look.signals)
    return Section(name, title, words, chart, commands=look.commands, is_listed=False)


def _chart(name: str, title: str, signals: Signals) -> Chart:
    time, moved = signals.time, signals.displacements
    before, after = moved or signals.setpoints
    size = np.abs(after - before)
    place = int(np.nanargmax(size)) if np.isfinite(size).any() else 0
    part = slice(*np.searchsorted(time, [time[place] - AROUND, time[place] + AROUND]))
    largest = slice(place, place + 1 if size[place] > 0.0 else place)
    x, given = time[part], signals.given[part]
    if moved is None:
        curve = Curve('displacement', x, _MM * given, COLOUR_OF['displacement'])
        panels = [
            Panel('recorded displacement (mm)', [curve]),
            *_compared('setpoint', 'A', 1.0, time, signals.setpoints, part, largest),
        ]
    else:
        curve = Curve('acceleration', x, given, COLOURS[2])
        setpoints = _compared('setpoint in the simulation', 'A', 1.0, time, signals.setpoints, part)
        panels = [
            Panel('recorded acceleration of the chassis (m/s²)', [curve]),
            *_compared('simulated displacement', 'mm', _MM, time, moved, part, largest),
            setpoints[0],
        ]
    origin = 'first displacement sample' if moved is None else 'beginning of the recorded acceleration'
    # at first what is around the difference is seen, and nothing beyond the ends of the recording
    begin = min(float(time[place]) - AT_FIRST, float(time[-1]) - 2.0 * AT_FIRST)
    begin = max(begin, float(time[0]))
    view = begin, min(begin + 2.0 * AT_FIRST, float(time[-1]))
    return Chart(name, title, f'seconds from the {origin}', panels, view=view)


def _compared(
    label: str,
    unit: str,
    factor: float,
    time: Array,
    pair: tuple[Array, Array],
    part: slice,
    largest: slice | None = None,
) -> list[Panel]:
    """Return two panels of a part of two signals: both, with a dot at the `largest`, and the difference."""
    x, before, after = time[part], factor * pair[0][part], factor * pair[1][part]
    curves = [
        Curve('as recorded', x, before, COLOURS[0], width=1.6),
        Curve('changed', x, after, COLOURS[1], DASHED, width=1.6),
    ]
    dots = []
    if largest is not None and largest.start < largest.stop:
        dots = [Dots('largest difference', time[largest], factor * pair[1][largest], LEVEL_COLOUR)]
    difference, scale, shown = after - before, 1.0, unit
    if unit == 'mm':
        scale, shown = handy_unit('m', difference / _MM)
        scale /= _MM
    curve = Curve('difference', x, scale * difference, DIFFERENCE_COLOUR)
    return [
        Panel(f'{label} ({unit})', curves, dots),
        Panel(f'{label}, changed minus as recorded ({shown})', [curve], share=0.7),
    ]
