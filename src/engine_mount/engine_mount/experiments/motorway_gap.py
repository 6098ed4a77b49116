"""Fig. 15: over a gap in the motorway; displacement with both switching levels, and the current."""

from collections import defaultdict
from typing import Annotated, NamedTuple

import numpy as np

from engine_mount.experiments.harness.closed_loop import drive_cases, paper_policy
from engine_mount.experiments.harness.experiment import (
    NOT_COMPARABLE,
    OURS,
    PAPER,
    PARTLY,
    Experiment,
    Findings,
    Holds,
    Order,
    Values,
    claim,
    holds_if,
    numbers_of,
)
from engine_mount.experiments.harness.measures import rms
from engine_mount.reports.drawing.chart import SPAN_COLOUR, Chart, Curve, Panel, level_lines, look_of
from engine_mount.reports.drive.signals import DriveSignals, FloatArray, switching
from mount_control.policy import switched_viscous
from mount_models.quantity import Quantity

NAME = 'motorway_gap'
FRICTION, HYDRO, OFF = 'friction', 'hydromount', 'friction, 0 A'
_MOUNTS = {FRICTION: 'friction', HYDRO: 'hydro', OFF: 'friction_off'}
_LOOKS = {FRICTION: look_of(FRICTION), HYDRO: look_of(HYDRO), OFF: look_of('no current')}
WINDOW = (0.2, 1.2)  # s after the switch-on level was exceeded: damping has come on, the gap still rings
_DELAY = (0.125, 0.200)  # s, chosen: one period, and up to 0.6 more for the band-pass and the rise
_OFF_TOLERANCE = 0.020  # s, chosen
_CLEAR = 0.75  # chosen: a clear effect leaves less than so much
_BEFORE, _AFTER = 0.3, 1.5  # s, drawn round the moment at which the switch-on level is exceeded


class GapParameters(NamedTuple):
    """The gap that is drawn, when it comes, others to compare with (m), and the characteristic."""

    gap_depth: Annotated[float, Quantity('m', 'depth of the gap that is drawn', 0.001, 0.1)] = 0.020
    gap_time: Annotated[float, Quantity('s', 'when the wheel meets it', 0.5, 60.0)] = 2.0
    duration: Annotated[float, Quantity('s', 'length of the drive', 2.5, 120.0)] = 6.0
    compared_depths: str = '0.010, 0.020, 0.030'
    damper: str = switched_viscous.DEFAULT_DAMPER


def run(order: Order) -> Findings:
    """Drive every mount over gaps of several depths, record it, and evaluate the recordings."""
    own, control = order.parameters, paper_policy(order)
    depths = sorted({*numbers_of(order, 'compared_depths', 0.001, 0.1), own.gap_depth})
    road = {
        'scenario': 'motorway',
        'timeline.duration': own.duration,
        'motorway.gap_time': own.gap_time,
    }
    cases = {
        f'{1e3 * depth:g} mm, {name}': {**road, 'motorway.gap_depth': depth, 'mount': mount}
        for depth in depths
        for name, mount in _MOUNTS.items()
    }
    drives = drive_cases(order, cases)
    gaps: dict[str, dict[str, DriveSignals]] = defaultdict(dict)
    for case, driven in drives.items():
        gap, name = case.split(', ', 1)
        gaps[gap][name] = driven
    found = {gap: figures_of(each, own.gap_time, control) for gap, each in gaps.items()}
    shown = f'{1e3 * own.gap_depth:g} mm'
    figures = {
        **found[shown],
        'gap_depth_m': own.gap_depth,
        'damper': own.damper,
        'switch_on_level_m': control.switch_on_level,
        'switch_off_level_m': control.switch_off_level,
        'period_s': 1.0 / control.eigenfrequency,
        'policy': order.policy,
        'gaps': found,
    }
    picture = draw_gap(gaps[shown], shown, figures)
    return Findings(figures, {NAME: picture}, [each.recording for each in drives.values()])


def figures_of(
    drives: dict[str, DriveSignals], gap_time: float, control: switched_viscous.Parameters
) -> Values:
    """Return delays and durations of damping (s), rms and peaks (m); None if the level was not exceeded."""
    seen, truth = drives[FRICTION].seen, drives[FRICTION].truth
    above = (seen.time >= gap_time) & (np.abs(seen.displacement) > control.switch_on_level)
    if not above.any():
        names = ('exceeded_s', 'on_delay_s', 'on_duration_s', 'off_delay_s', 'off_delay_in_band_s')
        return dict.fromkeys((*names, 'rms_m', 'peak_m', 'highest_current_a'))
    exceeded = float(seen.time[above][0])
    changes = switching(seen)
    on = next((time for time in changes.on if time >= exceeded), None)
    off = None if on is None else next((time for time in changes.off if time > on), None)

    def delay(values: FloatArray) -> float | None:
        """Return how long before the end of damping `values` were last at or beyond the level."""
        if off is None:
            return None
        beyond = (seen.time < off) & (np.abs(values) >= control.switch_off_level)
        return off - float(seen.time[beyond][-1])

    truths = {name: drive.truth for name, drive in drives.items()}
    begin, end = (exceeded + edge for edge in WINDOW)
    return {
        'exceeded_s': exceeded,
        'on_delay_s': None if on is None else on - exceeded,
        'on_duration_s': None if on is None or off is None else off - on,
        'off_delay_s': delay(seen.displacement),
        'off_delay_in_band_s': delay(seen.band_displacement),  # which control compares with the level
        'rms_m': {
            name: rms(each.displacement[(each.time >= begin) & (each.time < end)])
            for name, each in truths.items()
        },
        'peak_m': {
            name: np.max(np.abs(each.displacement[each.time >= exceeded])) for name, each in truths.items()
        },
        'highest_current_a': truth.coil_current.max(),
    }


def _delays(figures: Values, key: str) -> tuple[list[float], str]:
    """Return the known times, and all of them told by gap."""
    delays = {gap: found[key] for gap, found in figures['gaps'].items()}
    told = (
        f'{gap}: never' if delay is None else f'{gap}: {1e3 * delay:.0f} ms' for gap, delay in delays.items()
    )
    return [delay for delay in delays.values() if delay is not None], ', '.join(told)


def _shares(figures: Values, key: str, other: str) -> tuple[list[float], str]:
    """Return the figure over that of the `other` mount where it is known, and all of them told by gap."""
    known, told = [], []
    for gap, found in figures['gaps'].items():
        if found[key]:
            known.append(found[key][FRICTION] / found[key][other])
            told.append(f'{gap}: {known[-1]:.2f}')
        elif key == 'rms_m':
            told.append(f'{gap}: level not exceeded')
    return known, ', '.join(told)


@claim(
    'Fig. 15; Sec. 6',
    paper='One period after the displacement exceeds the switch-on level of 0.8 mm damping is activated.',
)
def _on_switching_on(figures):
    if figures['policy'] != PAPER:
        return NOT_COMPARABLE, 'This policy opens with the amplitude, without waiting.'
    known, told = _delays(figures, 'on_delay_s')
    told = f"""From the first sample above {1e3 * figures['switch_on_level_m']:g} mm to damping on, by depth
        of the gap, {told}. One period is {1e3 * figures['period_s']:.0f} ms; the rest is the band-pass.
        Counted as one period from {1e3 * _DELAY[0]:.0f} to {1e3 * _DELAY[1]:.0f} ms (chosen)."""
    return holds_if([_DELAY[0] <= delay <= _DELAY[1] for delay in known]), told


@claim('Fig. 15', paper='A significant effect of damping can be seen.')
def _on_effect(figures):
    known, told = _shares(figures, 'rms_m', OFF)
    told = f"""Rms of the displacement from {WINDOW[0]:g} to {WINDOW[1]:g} s behind that moment over that of
        the same mount without current, by depth of the gap, {told}; counted as significant below {_CLEAR:g}
        (chosen)."""
    return holds_if([share < _CLEAR for share in known]), told


@claim(
    'Fig. 15; Sec. 6',
    paper="""When the displacement stays below the switch-off level of 0.35 mm for more than one period,
    damping is deactivated.""",
)
def _on_switching_off(figures):
    if figures['policy'] != PAPER:
        return NOT_COMPARABLE, 'This policy closes slowly, at no moment.'
    period = figures['period_s']
    (shown, measured), (compared, in_band), (durations, _) = (
        _delays(figures, key) for key in ('off_delay_s', 'off_delay_in_band_s', 'on_duration_s')
    )
    lasting = ''
    if durations:
        lasting = f' Damping was on for {1e3 * min(durations):.0f} to {1e3 * max(durations):.0f} ms.'
    told = f"""From the last sample above {1e3 * figures['switch_off_level_m']:g} mm to damping off, by depth
        of the gap: of the band-passed displacement, which the control compares, {in_band}; of the measured
        one, which the picture shows, {measured}.{lasting} Counted as one period ({1e3 * period:.0f} ms)
        within {1e3 * _OFF_TOLERANCE:.0f} ms (chosen)."""
    return holds_if([abs(delay - period) <= _OFF_TOLERANCE for delay in shown + compared]), told


@claim('Sec. 7', paper='On good roads the friction mount has a clear advantage.')
def _on_hydro(figures):
    known, told = _shares(figures, 'rms_m', HYDRO)
    clear = holds_if([share < _CLEAR for share in known])
    told = f"""Rms of the displacement in the same second over that of the hydromount, {told}; counted as
        clear below {_CLEAR:g} (chosen). The highest peak over that of the hydromount,
        {_shares(figures, 'peak_m', HYDRO)[1]}."""
    if figures['policy'] == PAPER:
        told += " It comes before damping is on; the hydromount's is always there."
    return PARTLY if clear is Holds.NO and min(known) < 1.0 else clear, told


def draw_gap(drives: dict[str, DriveSignals], depth: str, figures: Values) -> Chart:
    """Return displacement with both switching levels above, the coil's current below, Fig. 15."""
    seen, truth = drives[FRICTION].seen, drives[FRICTION].truth
    middle = figures['exceeded_s'] or float(truth.time[-1]) / 2.0
    moved = [
        Curve(name, each.truth.time, 1e3 * each.truth.displacement, *_LOOKS[name])
        for name, each in reversed(drives.items())
    ]
    levels = {
        f'{name} level': figures[f'{name.replace("-", "_")}_level_m'] for name in ('switch-on', 'switch-off')
    }
    panels = [
        Panel('displacement (mm)', moved, level_lines(levels), share=1.5),
        Panel('coil current (A)', [Curve('current', truth.time, truth.coil_current)], least=(0.0, 0.1)),
    ]
    shade = Curve('damping on', seen.time, seen.damping_active.astype(float), SPAN_COLOUR)
    title, x = f'Over a gap of {depth} in the motorway (Fig. 15)', 'time from the start of the drive (s)'
    return Chart(NAME, title, x, panels, shade, view=(middle - _BEFORE, middle + _AFTER))


EXPERIMENT = Experiment(
    NAME,
    """A car at 119 km/h on a good road meets a gap; the paper does not give its size, so three depths are
    driven, each with the friction mount, the same without current, and the original hydromount. Times
    and rms come from the recordings.""",
    GapParameters(),
    run,
    closed_loop=True,
    policies=(PAPER, OURS),
)
