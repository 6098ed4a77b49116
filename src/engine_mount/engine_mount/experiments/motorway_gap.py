"""Fig. 15: over a gap in the motorway; displacement with both switching levels, and the current."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np

from engine_mount.experiments.harness.closed_loop import PAPER, driven, mode_of
from engine_mount.experiments.harness.contract import (
    Experiment,
    Holds,
    Order,
    Outcome,
    Progress,
    Settings,
    Statement,
    Values,
    holds_if,
    numbers_of,
    parameters_of,
)
from engine_mount.experiments.harness.drawing import BLUE, GREY, RED, finish, new_figure
from engine_mount.experiments.registry import NAMES
from engine_mount.reports.drawing.style import HYDROMOUNT_COLOUR, UNDAMPED_COLOUR
from engine_mount.reports.drive.evaluation import switching
from engine_mount.reports.drive.signals import DriveSignals, FloatArray, Seen
from mount_control.policy import switched_viscous
from mount_models.damper import damper_curve
from mount_models.quantity import Quantity, with_flattened

FRICTION, HYDRO, OFF = 'friction', 'hydromount', 'friction, 0 A'
WINDOW = (0.2, 1.2)  # s after the switch-on level was exceeded: damping has come on, the gap still rings


@dataclass(frozen=True)
class Crossing:
    """The three mounts over one gap; `exceeded` (s) is when the friction mount first left the on level."""

    drives: dict[str, DriveSignals]
    exceeded: float | None


def figures_of(crossing: Crossing, control: switched_viscous.Parameters) -> Values:
    """Return delays and durations of damping (s), rms and peaks (m); None if the level was not exceeded."""
    found: Values = {'exceeded_s': crossing.exceeded}
    if crossing.exceeded is None:
        return found | dict.fromkeys(
            (
                'on_delay_s',
                'on_duration_s',
                'off_delay_s',
                'off_delay_in_band_s',
                'rms_m',
                'peak_m',
                'highest_current_a',
            )
        )
    seen, truth = crossing.drives[FRICTION].seen, crossing.drives[FRICTION].truth
    changes = switching(seen)
    on = next((time for time in changes.on if time >= crossing.exceeded), None)
    off = None if on is None else next((time for time in changes.off if time > on), None)
    begin, end = (crossing.exceeded + edge for edge in WINDOW)
    rms, peak = {}, {}
    for name, drive in crossing.drives.items():
        time, displacement = drive.truth.time, drive.truth.displacement
        rms[name] = float(np.sqrt(np.mean(displacement[(time >= begin) & (time < end)] ** 2)))
        peak[name] = float(np.max(np.abs(displacement[time >= crossing.exceeded])))

    def left(values: FloatArray) -> float | None:
        return None if off is None else off - _last_above(seen.time, values, control.switch_off_level, off)

    return found | {
        'on_delay_s': None if on is None else on - crossing.exceeded,
        'on_duration_s': None if on is None or off is None else off - on,
        'off_delay_s': left(seen.displacement),
        'off_delay_in_band_s': left(seen.band_displacement),  # which control compares with the level
        'rms_m': rms,
        'peak_m': peak,
        'highest_current_a': float(truth.coil_current.max()),
    }


def _last_above(time: FloatArray, values: FloatArray, level: float, before: float) -> float:
    """Return when `values` were last at or beyond the `level`, earlier than `before` (s)."""
    return float(time[np.flatnonzero((time < before) & (np.abs(values) >= level))[-1]])


NAME = 'motorway_gap'
_MOUNTS = {FRICTION: 'friction', HYDRO: 'hydro', OFF: 'friction_off'}
_DELAY = (0.125, 0.200)  # s, chosen: one period, and up to 0.6 more for the band-pass and the rise
_OFF_TOLERANCE = 0.020  # s, chosen
_CLEAR = 0.75  # chosen: a clear effect leaves less than so much


class GapParameters(NamedTuple):
    """The gap that is drawn, when it comes, others to compare with (m), and the characteristic."""

    gap_depth: Annotated[float, Quantity('m', 'depth of the gap that is drawn', 0.001, 0.1)] = 0.020
    gap_time: Annotated[float, Quantity('s', 'when the wheel meets it', 0.5, 60.0)] = 2.0
    duration: Annotated[float, Quantity('s', 'length of the drive', 2.5, 120.0)] = 6.0
    compared_depths: str = '0.010, 0.020, 0.030'
    damper: str = switched_viscous.DEFAULT_DAMPER


def run(order: Order, progress: Progress) -> Outcome:
    """Drive every mount over gaps of several depths, record it, and evaluate the recordings."""

    parameters = parameters_of(order, NAME, GapParameters())
    damper_curve(parameters.damper)  # refuses an unknown one before anything is made
    control = with_flattened(switched_viscous.Parameters(), order.settings.get('mount_control', {}))
    compared = numbers_of(f'{NAME}.compared_depths', parameters.compared_depths, 0.001, 0.1)
    depths = sorted({*compared, parameters.gap_depth})
    crossings: dict[float, Crossing] = {}
    for number, depth in enumerate(depths):
        drives = {}
        for place, (name, mount) in enumerate(_MOUNTS.items()):
            share = (number + place / len(_MOUNTS)) / len(depths)
            progress(0.95 * share, f'gap of {1e3 * depth:g} mm, {name}')
            label = f'{1e3 * depth:g}mm_{name.replace(", ", "_").replace(" ", "")}'
            drives[name] = driven(order, label, _own(parameters, depth, mount), NAME)
        crossings[depth] = Crossing(
            drives, _exceeded(drives[FRICTION].seen, control.switch_on_level, parameters)
        )
    progress(0.95, 'pictures')
    figures = _figures(crossings, parameters, control, mode_of(order))
    shown = crossings[parameters.gap_depth]
    picture = draw_gap(shown, parameters.gap_depth, control, order.out / 'motorway_gap.png')
    recordings = [each.recording for crossing in crossings.values() for each in crossing.drives.values()]
    return Outcome(figures, [picture], recordings, _statements(figures))


def _own(parameters: GapParameters, depth: float, mount: str) -> Settings:
    return {
        'mount_sim': {
            'scenario': 'motorway',
            'mount': mount,
            'timeline.duration': parameters.duration,
            'motorway.gap_depth': depth,
            'motorway.gap_time': parameters.gap_time,
        },
        'mount_control': {'policy': PAPER, 'damper': parameters.damper},
    }


def _exceeded(seen: Seen, level: float, parameters: GapParameters) -> float | None:
    """Return when the displacement first left the level behind the gap's beginning, None for never."""
    above = np.flatnonzero((seen.time >= parameters.gap_time) & (np.abs(seen.displacement) > level))
    return float(seen.time[above[0]]) if above.size else None


def _figures(
    crossings: dict[float, Crossing],
    parameters: GapParameters,
    control: switched_viscous.Parameters,
    mode: str,
) -> Values:
    told = {f'{1e3 * depth:g} mm': figures_of(each, control) for depth, each in crossings.items()}
    return {
        **told[f'{1e3 * parameters.gap_depth:g} mm'],
        'gap_depth_m': parameters.gap_depth,
        'damper': parameters.damper,
        'switch_on_level_m': control.switch_on_level,
        'switch_off_level_m': control.switch_off_level,
        'period_s': 1.0 / control.eigenfrequency,
        'mode': mode,
        'gaps': told,
    }


def _statements(figures: Values) -> list[Statement]:
    return [_on_switching_on(figures), _on_effect(figures), _on_switching_off(figures), _on_hydro(figures)]


def _on_switching_on(figures: Values) -> Statement:
    delays = {gap: found['on_delay_s'] for gap, found in figures['gaps'].items()}
    known = [delay for delay in delays.values() if delay is not None]
    inside = [_DELAY[0] <= delay <= _DELAY[1] for delay in known]
    told = _delays(delays)
    return Statement(
        'Fig. 15; Sec. 6',
        'One period after the displacement exceeds the switch-on level of 0.8 mm damping is activated.',
        f'From the first sample above {1e3 * figures["switch_on_level_m"]:g} mm to damping on, by depth '
        f'of the gap, {told}. One period is {1e3 * figures["period_s"]:.0f} ms; the rest is the band-pass. '
        f'Counted as one period from {1e3 * _DELAY[0]:.0f} to {1e3 * _DELAY[1]:.0f} ms (chosen).',
        holds_if(inside),
    )


def _on_effect(figures: Values) -> Statement:
    known, told = _shares(figures, OFF)
    return Statement(
        'Fig. 15',
        'A significant effect of damping can be seen.',
        f'Rms of the displacement from {WINDOW[0]:g} to {WINDOW[1]:g} s behind that moment over that '
        f'of the same mount without current, by depth of the gap, {told}; counted as significant below '
        f'{_CLEAR:g} (chosen). The first peak comes before damping and is the same.',
        holds_if([share < _CLEAR for share in known]),
    )


def _on_switching_off(figures: Values) -> Statement:
    gaps, period = figures['gaps'], figures['period_s']
    shown = {gap: found['off_delay_s'] for gap, found in gaps.items()}
    compared = {gap: found['off_delay_in_band_s'] for gap, found in gaps.items()}
    durations = [found['on_duration_s'] for found in gaps.values() if found['on_duration_s'] is not None]
    answers = [
        abs(delay - period) <= _OFF_TOLERANCE
        for delay in (*shown.values(), *compared.values())
        if delay is not None
    ]
    lasting = f' Damping was on for {_span(durations)}.' if durations else ''
    return Statement(
        'Fig. 15; Sec. 6',
        'When the displacement stays below the switch-off level of 0.35 mm for more than one period, damping '
        'is deactivated.',
        f'From the last sample above {1e3 * figures["switch_off_level_m"]:g} mm to damping off, by depth of '
        f'the gap: of the band-passed displacement, which the control compares, {_delays(compared)}; of the '
        f'measured one, which the picture shows, {_delays(shown)}.{lasting} Counted as one period '
        f'({1e3 * period:.0f} ms) within {1e3 * _OFF_TOLERANCE:.0f} ms (chosen).',
        holds_if(answers),
    )


def _delays(delays: dict[str, float | None]) -> str:
    return ', '.join(f'{gap}: {_milliseconds(delay)}' for gap, delay in delays.items())


def _on_hydro(figures: Values) -> Statement:
    known, told = _shares(figures, HYDRO)
    peaks = {gap: found['peak_m'] for gap, found in figures['gaps'].items() if found['peak_m']}
    clear, less = holds_if([share < _CLEAR for share in known]), any(share < 1.0 for share in known)
    first = ', '.join(f'{gap}: {p[FRICTION] / p[HYDRO]:.2f}' for gap, p in peaks.items())
    return Statement(
        'Sec. 7',
        'On good roads the friction mount has a clear advantage.',
        f'Rms of the displacement in the same second over that of the hydromount, {told}; counted as '
        f'clear below {_CLEAR:g} (chosen). The highest peak over that of the hydromount, {first}: it comes '
        "before damping is on, and the hydromount's damping is always there.",
        Holds.PARTLY if clear is Holds.NO and less else clear,
    )


def _shares(figures: Values, other: str) -> tuple[list[float], str]:
    """Return the rms over that of the `other` mount where it is known, and all of it told by gap."""
    shares = {
        gap: found['rms_m'][FRICTION] / found['rms_m'][other] if found['rms_m'] else None
        for gap, found in figures['gaps'].items()
    }
    told = ', '.join(f'{gap}: {_number(share)}' for gap, share in shares.items())
    return [share for share in shares.values() if share is not None], told


def _milliseconds(seconds: float | None) -> str:
    return 'never' if seconds is None else f'{1e3 * seconds:.0f} ms'


def _number(value: float | None) -> str:
    return 'level not exceeded' if value is None else f'{value:.2f}'


def _span(durations: list[float]) -> str:
    return f'{1e3 * min(durations):.0f} to {1e3 * max(durations):.0f} ms'


_BEFORE, _AFTER = 0.3, 1.5  # s round the moment at which the switch-on level is exceeded


def draw_gap(crossing: Crossing, depth: float, control: switched_viscous.Parameters, file: Path) -> Path:
    """Draw displacement with both switching levels above, the coil's current below, Fig. 15."""
    figure = new_figure(f'Over a gap of {1e3 * depth:g} mm in the motorway (Fig. 15)', 6.5)
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    seen, truth = crossing.drives[FRICTION].seen, crossing.drives[FRICTION].truth
    middle = float(truth.time[-1]) / 2.0 if crossing.exceeded is None else crossing.exceeded
    begin, end = middle - _BEFORE, middle + _AFTER
    for name, colour, dash in ((OFF, UNDAMPED_COLOUR, ':'), (HYDRO, HYDROMOUNT_COLOUR, '--')):
        other = crossing.drives[name].truth
        shown = (other.time >= begin) & (other.time <= end)
        upper.plot(
            other.time[shown], 1e3 * other.displacement[shown], color=colour, linestyle=dash,
            linewidth=1.0, label=name,
        )  # fmt: skip
    shown = (seen.time >= begin) & (seen.time <= end)
    upper.plot(seen.time[shown], 1e3 * seen.displacement[shown], color=BLUE, linewidth=1.8, label=FRICTION)
    for level, dash, name in (
        (control.switch_on_level, '--', 'switch-on level'),
        (control.switch_off_level, '-.', 'switch-off level'),
    ):
        for sign in (1.0, -1.0):
            upper.axhline(
                1e3 * sign * level, color=RED, linestyle=dash, linewidth=0.8,
                label=name if sign > 0.0 else None,
            )  # fmt: skip
    current = (truth.time >= begin) & (truth.time <= end)
    lower.plot(truth.time[current], truth.coil_current[current], color=BLUE)
    for axes in (upper, lower):
        axes.fill_between(
            seen.time[shown], 0.0, 1.0, where=seen.damping_active[shown], color=GREY, alpha=0.15,
            transform=axes.get_xaxis_transform(), label='damping on', step='post', linewidth=0.0,
        )  # fmt: skip
    upper.set_ylabel('displacement (mm)')
    lower.set_ylabel('coil current (A)')
    lower.set_xlabel('time from the start of the drive (s)')
    lower.set_ylim(0.0, max(0.1, 1.1 * float(np.max(truth.coil_current[current]))))
    upper.legend(loc='upper right', ncols=2, fontsize='small')
    return finish(figure, file)


EXPERIMENT = Experiment(
    NAME,
    *NAMES[NAME],
    (
        'A car at 119 km/h on a good road meets a gap; the paper does not tell its size, so three depths are '
        'driven, each with the friction mount, the same without current, and the original hydromount. Times '
        'and rms come from the recordings.'
    ),
    GapParameters(),
    run,
    closed_loop=True,
)
