"""A recorded drive of a real car: friction mount, hydromount and elastomer alone on the same acceleration."""

from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from engine_mount.experiments.harness.closed_loop import drive_cases, paper_policy
from engine_mount.experiments.harness.drawing import (
    BLUE,
    HYDRO_LINE,
    OFF_LINE,
    draw_level,
    new_panels,
    shade_damping,
)
from engine_mount.experiments.harness.experiment import (
    PAPER,
    Experiment,
    ExperimentError,
    Findings,
    Order,
    Values,
    claim,
    holds_if_lower,
    in_one_line,
    table,
)
from engine_mount.experiments.harness.measures import rms
from engine_mount.reports.drive.signals import DriveSignals, FloatArray, switching
from engine_mount.reports.sections.periodic import rms_in_bands
from engine_mount.signals.excitation import recorded_signal
from mount_control.policy.switched_viscous import DEFAULT_DAMPER
from mount_models.quantity import Quantity
from mount_models.sampling import SAMPLE_TIME
from mount_sim.excitation.scenario import AccelerationScale, RecordedScenario

NAME = 'recorded_drive'
FRICTION, HYDRO, ELASTOMER = 'friction mount', 'hydromount', 'elastomer alone'
_MOUNTS = {FRICTION: 'friction', HYDRO: 'hydro', ELASTOMER: 'elastomer'}
_LINES: dict[str, Values] = {
    ELASTOMER: OFF_LINE,
    HYDRO: HYDRO_LINE,
    FRICTION: {'color': BLUE, 'linestyle': '-'},
}
"""How each mount is drawn, the one that lies on top last."""
BANDS = ((1.0, 5.0), (5.0, 12.0), (12.0, 30.0))
"""Hz, chosen: the car's body, the engine on its mounts, above."""
_BAND_NAMES = [f'{low:g} to {high:g} Hz' for low, high in BANDS]
_FILTER_ORDER = 4  # chosen, of the band-pass that goes forth and back
_BEFORE, _AFTER = 1.0, 4.0  # s, drawn round the largest displacement
BoolArray = npt.NDArray[np.bool_]


class RecordedDriveParameters(NamedTuple):
    """Where the recorded acceleration stands, as in the scenario `recorded`; and the characteristic."""

    file: str = ''
    column: str = ''
    time_column: str = ''
    topic: str = ''
    scale: AccelerationScale = 1.0
    duration: Annotated[float, Quantity('s', 'so much from its beginning; 0: all of it', 0.0, 3600.0)] = 0.0
    damper: str = DEFAULT_DAMPER


def run(order: Order) -> Findings:
    """Drive every mount on the recording, and evaluate bands."""
    own = order.parameters
    if not own.file:
        raise ExperimentError(
            f'{NAME} needs a recorded vertical acceleration (CSV, MCAP, or a folder of NPY pairs): give '
            f'--set {NAME}.file=FILE, its --set {NAME}.column=NAME, and --set {NAME}.scale=-1 where its axis '
            'points down'
        )
    recorded = RecordedScenario(*(getattr(own, name) for name in RecordedScenario._fields))
    rate = recorded_signal(recorded).rate  # refuses what cannot be read
    drive = {
        'scenario': 'recorded',
        'timeline.duration': own.duration,
        **{f'recorded.{name}': value for name, value in recorded._asdict().items()},
        'recorded.file': str(Path(own.file).absolute()),
    }
    drives = drive_cases(order, {name: {**drive, 'mount': mount} for name, mount in _MOUNTS.items()})
    figures = figures_of(drives, order)
    pictures = {NAME: draw_traces(drives, figures['switch_on_level_m'])}
    recordings = [each.recording for each in drives.values()]
    return Findings(figures, pictures, recordings, {f'{NAME}.md': page_of(figures, rate)})


def rms_in_bands_within(values: FloatArray, within: BoolArray) -> list[float] | None:
    """Return the rms of `values` (n,) at 1 kHz in each of `BANDS` at the samples `within` (n,), None of none.

    By a band-pass without phase: what happens at one time stays there but for about a period of the lower
    edge. At both edges of the band a quarter of the power is left.
    """
    from scipy.signal import butter, sosfiltfilt  # here, for it takes longer to load than all the rest

    if not within.any():
        return None
    found = []
    for band in BANDS:
        sections = butter(_FILTER_ORDER, band, 'bandpass', fs=1.0 / SAMPLE_TIME, output='sos')
        found.append(rms(sosfiltfilt(sections, values - np.mean(values))[within]))
    return found


def figures_of(drives: dict[str, DriveSignals], order: Order) -> Values:
    """Return rms of displacement and force: of all, by band, at the moments of damping and else."""
    own, control = order.parameters, paper_policy(order)
    seen, truth = drives[FRICTION].seen, drives[FRICTION].truth
    active = np.interp(truth.time, seen.time, seen.damping_active.astype(float)) > 0.5
    margin = round(1.0 / (control.eigenfrequency * SAMPLE_TIME))  # samples, before and behind
    events = np.convolve(active, np.ones(2 * margin + 1), 'same') > 0.5
    changes = switching(seen)
    runs: dict[str, Values] = {name: {} for name in drives}
    for name, drive in drives.items():
        moved = (('displacement', 'm', drive.truth.displacement), ('force', 'n', drive.truth.mount_force))
        for what, unit, values in moved:
            runs[name] |= {
                f'{what}_rms_{unit}': rms(values),
                f'{what}_peak_{unit}': np.max(np.abs(values)),
                f'{what}_band_rms_{unit}': rms_in_bands(values, BANDS),
                f'{what}_band_rms_at_events_{unit}': rms_in_bands_within(values, events),
                f'{what}_band_rms_else_{unit}': rms_in_bands_within(values, ~events),
            }
    return {
        'source': Path(own.file).name,
        'column': own.column,
        'scale': own.scale,
        'duration_s': truth.time[-1] - truth.time[0] + SAMPLE_TIME,
        'acceleration_band_rms_m_s2': rms_in_bands(truth.chassis_acceleration, BANDS),
        'damper': own.damper,
        'switch_on_level_m': control.switch_on_level,
        'times_on': len(changes.on),
        'switched_on_s': list(changes.on),
        'damping_active_share': np.mean(active),
        'events_share': np.mean(events),
        'events_margin_s': 1.0 / control.eigenfrequency,
        'runs': runs,
    }


def ratios(figures: Values, key: str, other: str = HYDRO) -> list[float]:
    """Return by band the friction mount's rms over that of `other`; nothing where there is no such rms."""
    mine, its = figures['runs'][FRICTION][key], figures['runs'][other][key]
    return [] if mine is None else [each / beside for each, beside in zip(mine, its, strict=True)]


def _by_band(values: list[float]) -> str:
    if not values:
        return 'unknown, for damping was never on'
    return ', '.join(f'{value:.2f} ({band})' for band, value in zip(_BAND_NAMES, values, strict=True))


@claim(
    'Secs. 1, 7',
    paper="""On good roads the mount is a soft spring without damping and performs better than a classical
    one.""",
)
def _on_isolation(figures):
    force, displacement = (
        ratios(figures, key) for key in ('force_band_rms_else_n', 'displacement_band_rms_else_m')
    )
    told = f"""Away from the moments of damping, rms over that of the hydromount: force on the chassis
        {_by_band(force)}; displacement {_by_band(displacement)}. Holds if force and displacement are lower
        from 5 Hz on; the chassis moves as recorded with any force."""
    return holds_if_lower([*force[1:], *displacement[1:]]), told


@claim('Sec. 7', paper='Lower displacements when damping is on.')
def _on_displacement(figures):
    hydro, soft = (
        ratios(figures, 'displacement_band_rms_at_events_m', other) for other in (HYDRO, ELASTOMER)
    )
    told = f"""Damping was on {figures['times_on']} times, {100 * figures['damping_active_share']:.1f} % of
        the drive. At these moments, rms over that of the hydromount: {_by_band(hydro)}; over that of the
        elastomer alone: {_by_band(soft)}. Holds if lower than the hydromount, 5 to 12 Hz."""
    return holds_if_lower(hydro[1:2]), told


def page_of(figures: Values, rate: float) -> str:
    """Return the page; `rate` (Hz) is that of the recording's sensor."""
    runs, share = figures['runs'], 100.0 * figures['damping_active_share']
    levels = zip(_BAND_NAMES, figures['acceleration_band_rms_m_s2'], strict=True)
    bands = ', '.join(f'{value:.3f} m/s^2 from {band}' for band, value in levels)
    column = f', `{figures["column"]}`' if figures['column'] else ''
    peaks = ', '.join(f'{name} {1e3 * each["displacement_peak_m"]:.2f} mm' for name, each in runs.items())
    said = {'Away from damping': _on_isolation, 'Damping on': _on_displacement}
    in_short = ''.join(f'- **{name}.** {in_one_line(judge(figures)[1])}\n' for name, judge in said.items())
    return f"""# A recorded drive: friction mount, hydromount, elastomer alone

`engine-mount experiment recorded_drive` writes this page from its numbers; do not edit it. `make
experiments` renews the page if the recording lies beside this repository, in `../shared/data/motorway_i280`;
otherwise the page stays unchanged. The recording is not part of this project. Any other vertical acceleration
(CSV, NPY, MCAP) can take its place:

```
engine-mount experiment recorded_drive --set recorded_drive.file=drive.csv --set recorded_drive.column=az \\
  --set recorded_drive.scale=-1
```

Driven: `{figures['source']}`{column}, times {figures['scale']:g}, {figures['duration_s']:.1f} s at \
{rate:.0f} samples per second, without its mean. Acceleration, rms: {bands}. \
Policy `{PAPER}`, damper {figures['damper']}.

## In short

{in_short}- **Largest displacement**: {peaks}.

## Bands

Spectra of displacement, force and acceleration: `engine-mount report` of the three recordings together.

Moments of damping are those with the friction damper on, and {figures['events_margin_s']:.3f} s before and \
behind: {100.0 * figures['events_share']:.1f} % of the drive, the same ones for all mounts. In the rest the \
friction mount is the elastomer alone. The whole is from its spectrum, the parts are by a band-pass that \
halves the amplitude at the edges of a band; so they do not add up.

Rms of the displacement in mm:

{_bands(runs, 'displacement', 'm', 1e3)}
Rms of the force on the chassis in N:

{_bands(runs, 'force', 'n', 1.0)}
## When damping was on

![Displacement over time](figures/recorded_drive.png)

Damping went on {figures['times_on']} times and was on for {share:.1f} % of the drive (switch-on level \
{1e3 * figures['switch_on_level_m']:g} mm).

## Limits of this comparison

- **The sensor is not at the mount.** The recording of the I-280 is that of a device behind the windscreen.
  Its signal there, after body, holder and its own noise, is taken as the motion of the chassis at the engine
  mount.
- **The car had other engine mounts.** The effect of that car's own engine and mounts on the body is in the
  recording already, and is no excitation by the road.
- **The bandwidth is small.** The sensor has {rate:.0f} samples per second: nothing above {rate / 2.0:.0f} \
Hz is known, and higher frequencies may
  be folded below. It contains nothing about the acoustics, up to 400 Hz; no engine vibration is added.
- **No feedback from force to chassis.** The chassis moves as recorded with every mount. So its acceleration
  is the same with all mounts, and the table compares the force on it instead. In a car, a mount that pushes
  more would also move the chassis, and the chassis would move the mount.
- **The hydromount's parameters are chosen**, as are the elastomer's and the engine's mass: magnitudes as in
  the literature, not those of this car nor those of the authors. Their effect:
  [results.md](results.md).
- **Friction acts only after the displacement left {1e3 * figures['switch_on_level_m']:g} mm for one \
period.** Such events are few in one drive:
  a figure over the whole drive mostly compares a soft spring with a hydromount, and figures of the events
  rest on a handful of them.
"""


def _bands(runs: Values, what: str, unit: str, scale: float) -> str:
    rows = []
    for part, key in (('whole', ''), ('moments of damping', 'at_events_'), ('the rest', 'else_')):
        for mount in _MOUNTS:
            values = runs[mount][f'{what}_band_rms_{key}{unit}']
            if values is not None:
                rows.append((part, mount, *(f'{scale * value:.3g}' for value in values)))
    return table(('part of the drive', 'mount', *_BAND_NAMES), rows)


def draw_traces(drives: dict[str, DriveSignals], level: float) -> Any:
    """Draw the whole drive above, the seconds round its largest displacement below."""
    seen, truth = drives[FRICTION].seen, drives[FRICTION].truth
    largest = int(np.argmax(np.abs(truth.displacement)))
    figure, (upper, lower) = new_panels(
        'A recorded drive: displacement of the mount over time', 2, height=7.5
    )
    upper.plot(truth.time, 1e3 * truth.displacement, color=BLUE, linewidth=0.6, label=FRICTION)
    begin, end = max(0.0, float(truth.time[largest]) - _BEFORE), float(truth.time[largest]) + _AFTER
    for (name, style), width in zip(_LINES.items(), (1.4, 1.2, 1.8), strict=True):
        each = drives[name].truth
        shown = (each.time >= begin) & (each.time <= end)
        lower.plot(each.time[shown], 1e3 * each.displacement[shown], linewidth=width, label=name, **style)
    for axes, first, last in ((upper, 0.0, float(truth.time[-1])), (lower, begin, end)):
        within = (seen.time >= first) & ((seen.time <= last) | (axes is upper))
        shade_damping(axes, seen, within, 0.18)
        draw_level(axes, level, 'switch-on level', '--', 0.9)
        axes.set(
            ylabel='displacement (mm)', xlabel='time from the start of the drive (s)', xlim=(first, last)
        )
        axes.legend(loc='upper right', ncols=3, fontsize='small')
    upper.set_ylim(top=1.4e3 * float(np.abs(truth.displacement[largest])))  # room for the legend
    return figure


EXPERIMENT = Experiment(
    NAME,
    """The vertical acceleration that a real car recorded moves the chassis side of the mount, with
    friction mount, original hydromount and elastomer alone in the seat. What each band holds comes from the
    recordings of these runs.""",
    RecordedDriveParameters(),
    run,
    closed_loop=True,
    policies=(PAPER,),
    needs='file',
)
