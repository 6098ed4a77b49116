"""A closer look at one recording of a fleet: where the change made the largest difference."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mount_report.drawing.chart import DASHED, Array, Chart, Curve, Dots, Panel
from mount_report.drawing.style import COLOUR_OF, COLOURS, DIFFERENCE_COLOUR, LEVEL_COLOUR
from mount_report.sections.section import Section

AROUND, AT_FIRST = (
    1.0,
    0.4,
)  # s, chosen: what is there before and after the largest difference, and seen at first
_MM = 1e3


@dataclass(frozen=True)
class Look:
    """One recording: what is known of it, the commands that open it, and its signals if they could be read.

    `value` is that of the column by which it was chosen. Signals are (n,) over `time` (s): displacement (m),
    setpoints (A) as recorded and with the change. `reason` says why there are none.
    """

    recording: str
    value: str
    commands: Sequence[str]
    time: Array | None = None
    displacement: Array | None = None
    before: Array | None = None
    after: Array | None = None
    reason: str = ''


def look_section(number: int, look: Look, by: str) -> Section:
    """Return the section about the recording at place `number` (1: the first) of the worst in column `by`."""
    title, name = f'{number}. {look.recording}', f'look_{number}'
    words = [f'{by}: {look.value}', *look.commands]
    if look.time is None or look.displacement is None or look.before is None or look.after is None:
        return Section(name, title, [*words, f'No picture: {look.reason}'])
    return Section(
        name, title, words, _chart(name, title, look.time, look.displacement, look.before, look.after)
    )


def _chart(name: str, title: str, time: Array, displacement: Array, before: Array, after: Array) -> Chart:
    difference = np.abs(after - before)
    known = np.isfinite(difference).any()
    place = int(np.nanargmax(difference)) if known else 0
    part = slice(*np.searchsorted(time, [time[place] - AROUND, time[place] + AROUND]))
    time, before, after = time[part], before[part], after[part]
    at = place - part.start
    largest = Dots('largest difference', time[at : at + 1], after[at : at + 1], LEVEL_COLOUR)
    panels = [
        Panel(
            'displacement (mm)',
            [Curve('displacement', time, _MM * displacement[part], COLOUR_OF['displacement'])],
        ),
        Panel(
            'setpoint (A)',
            [
                Curve('as recorded', time, before, COLOURS[0], width=1.6),
                Curve('changed', time, after, COLOURS[1], DASHED, width=1.6),
            ],
            [largest] if known and difference[place] > 0.0 else [],
        ),
        Panel(
            'setpoint, changed - as recorded (A)',
            [Curve('difference', time, after - before, DIFFERENCE_COLOUR)],
            share=0.7,
        ),
    ]
    view = (float(time[at]) - AT_FIRST, float(time[at]) + AT_FIRST)
    return Chart(name, title, 'seconds from the first sample of this recording', panels, view=view)
