"""A closer look at one recording of a fleet: where the change made the largest difference."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

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


@dataclass(frozen=True)
class Signals:
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


@dataclass(frozen=True)
class _Shown:
    """What both drives were given, and pairs of what came of it, in handy units; the first is compared."""

    given: Panel
    pairs: Sequence[tuple[str, str, tuple[Array, Array]]]  # name, unit, values


def look_section(number: int, look: Look) -> Section:
    """Return the section about the recording at place `number` (1: the first) of the worst."""
    title, name = f'{number}. {look.name}', f'look_{number}'
    words = [_difference(look.row), *([f'No picture: {look.reason}'] if look.signals is None else [])]
    chart = None if look.signals is None else _chart(name, title, look.signals)
    return Section(name, title, list(filter(None, words)), chart, commands=look.commands, is_listed=False)


def _difference(row: Mapping[str, Any]) -> str:
    """Return a sentence on the largest differences that the row tells."""
    told = []
    for what, column, unit in (('displacement', 'displacement', 'm'), ('setpoint', 'setpoint', 'A')):
        largest = row.get(f'{column}_difference_largest_{unit.lower()}')
        place = row.get(f'{column}_difference_largest_at_s')
        if largest is not None:
            at = '' if place is None else f' at {place:.3f} s'
            told.append(f'{what} {quantity(largest, unit, signed=True)}{at}')
    return f'Largest difference, changed minus as recorded: {"; ".join(told)}.' if told else ''


def _chart(name: str, title: str, signals: Signals) -> Chart:
    time = signals.time
    compared = signals.displacements or signals.setpoints
    difference = np.abs(compared[1] - compared[0])
    known = bool(np.isfinite(difference).any())
    place = int(np.nanargmax(difference)) if known else 0
    part = slice(*np.searchsorted(time, [time[place] - AROUND, time[place] + AROUND]))
    at = place - part.start
    shown = _shown(signals, part)
    panels = [shown.given]
    for number, (label, unit, (before, after)) in enumerate(shown.pairs):
        is_compared = number == 0
        largest = Dots('largest difference', time[place : place + 1], after[at : at + 1], LEVEL_COLOUR)
        panels.append(
            Panel(
                f'{label} ({unit})',
                [
                    Curve('as recorded', time[part], before, COLOURS[0], width=1.6),
                    Curve('changed', time[part], after, COLOURS[1], DASHED, width=1.6),
                ],
                [largest] if is_compared and known and difference[place] > 0.0 else [],
            )
        )
        if is_compared:
            panels.append(_difference_panel(label, unit, time[part], after - before))
    begin = 'beginning of the recorded acceleration' if signals.displacements else 'first displacement sample'
    return Chart(name, title, f'seconds from the {begin}', panels, view=_view(time, float(time[place])))


def _view(time: Array, at: float) -> tuple[float, float]:
    """Return what is seen at first of the time axis: around `at` (s), and nothing beyond its ends."""
    begin = min(at - AT_FIRST, float(time[-1]) - 2.0 * AT_FIRST)
    begin = max(begin, float(time[0]))
    return begin, min(begin + 2.0 * AT_FIRST, float(time[-1]))


def _difference_panel(label: str, unit: str, time: Array, difference: Array) -> Panel:
    factor, shown = (1.0, unit)
    if unit == 'mm':
        factor, shown = handy_unit('m', difference / _MM)
        factor /= _MM
    curve = Curve('difference', time, factor * difference, DIFFERENCE_COLOUR)
    return Panel(f'{label}, changed minus as recorded ({shown})', [curve], share=0.7)


def _shown(signals: Signals, part: slice) -> _Shown:
    time, given = signals.time[part], signals.given[part]
    setpoints = ('setpoint', 'A', _of(signals.setpoints, part, 1.0))
    if signals.displacements is None:
        curve = Curve('displacement', time, _MM * given, COLOUR_OF['displacement'])
        return _Shown(Panel('recorded displacement (mm)', [curve]), [setpoints])
    curve = Curve('acceleration', time, given, COLOURS[2])
    moved = ('simulated displacement', 'mm', _of(signals.displacements, part, _MM))
    panel = Panel('recorded acceleration of the chassis (m/s²)', [curve])
    return _Shown(panel, [moved, ('setpoint in the simulation', 'A', setpoints[2])])


def _of(pair: tuple[Array, Array], part: slice, factor: float) -> tuple[Array, Array]:
    return factor * pair[0][part], factor * pair[1][part]
