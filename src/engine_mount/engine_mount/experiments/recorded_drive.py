"""A recorded drive of a real car: friction mount, hydromount and elastomer alone on the same acceleration."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np
import numpy.typing as npt

from engine_mount.experiments.harness.closed_loop import PAPER, driven, mode_of
from engine_mount.experiments.harness.contract import (
    Experiment,
    ExperimentError,
    Order,
    Outcome,
    Progress,
    Settings,
    Statement,
    Values,
    holds_if_lower,
    parameters_of,
    write_page,
)
from engine_mount.experiments.harness.drawing import BLUE, GREY, RED, finish, new_figure
from engine_mount.experiments.harness.measures import rms_in_bands
from engine_mount.experiments.registry import NAMES
from engine_mount.reports.drawing.style import HYDROMOUNT_COLOUR, UNDAMPED_COLOUR
from engine_mount.reports.drive.evaluation import switching
from engine_mount.reports.drive.signals import DriveSignals, FloatArray, Truth
from engine_mount.signals.excitation import recorded_signal
from mount_control.policy import switched_viscous
from mount_models.damper import damper_curve
from mount_models.quantity import Quantity, with_flattened
from mount_models.sampling import SAMPLE_TIME
from mount_sim.excitation.scenario import AccelerationScale, RecordedScenario

FRICTION, HYDRO, ELASTOMER = 'friction mount', 'hydromount', 'elastomer alone'
BANDS = ((1.0, 5.0), (5.0, 12.0), (12.0, 30.0))
"""Hz, chosen: the car's body, the engine on its mounts, above."""
_SEGMENT = 4.096  # s, chosen: a spectrum with lines 0.24 Hz apart, and many segments in a minute
SHORTEST = 3.0 * _SEGMENT
_FILTER_ORDER = 4  # chosen, of the band-pass that goes forth and back
BoolArray = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class Spectra:
    """Amplitude densities over frequency (Hz): displacement (m/sqrt(Hz)), mount force (N/sqrt(Hz))."""

    frequency: FloatArray
    displacement: FloatArray
    force: FloatArray


def spectra_of(drive: DriveSignals) -> Spectra:
    """Return the amplitude densities of displacement and mount force (Welch, Hann window)."""
    frequency, displacement = _density(drive.truth.displacement)
    _, force = _density(drive.truth.mount_force)
    return Spectra(frequency, np.sqrt(displacement), np.sqrt(force))


def rms_in_bands_within(values: FloatArray, within: BoolArray) -> list[float] | None:
    """Return the rms of `values` (n,) at 1 kHz in each of `BANDS` at the samples `within` (n,), None of none.

    By a band-pass without phase: what happens at one time stays there but for about a period of the lower
    edge. At both edges of the band a quarter of the power is left.
    """
    from scipy.signal import butter, sosfiltfilt  # here, for they take longer to load than all the rest

    if not within.any():
        return None
    found = []
    for band in BANDS:
        sections = butter(_FILTER_ORDER, band, 'bandpass', fs=1.0 / SAMPLE_TIME, output='sos')
        passed = sosfiltfilt(sections, values - np.mean(values))[within]
        found.append(float(np.sqrt(np.mean(passed**2))))
    return found


def near(active: BoolArray, margin: float) -> BoolArray:
    """Return where damping is `active` (n,) at 1 kHz, and `margin` (s) before and behind."""
    count = round(margin / SAMPLE_TIME)
    return np.convolve(active, np.ones(2 * count + 1), 'same') > 0.5


def _density(values: FloatArray) -> tuple[FloatArray, FloatArray]:
    from scipy.signal import welch  # here, as above

    count = round(_SEGMENT / SAMPLE_TIME)
    if len(values) < round(SHORTEST / SAMPLE_TIME):
        raise ExperimentError(
            f'the recorded drive lasts {len(values) * SAMPLE_TIME:.1f} s; a spectrum needs at least '
            f'{SHORTEST:.1f} s: give a longer one'
        )
    frequency, density = welch(values, 1.0 / SAMPLE_TIME, 'hann', count, 3 * count // 4)  # evenly weighted
    return frequency, density


def ratios(figures: Values, key: str, other: str = HYDRO) -> list[float]:
    """Return by band the friction mount's rms over that of `other`; nothing where there is no such rms."""
    mine, its = figures['runs'][FRICTION][key], figures['runs'][other][key]
    return [] if mine is None else [each / beside for each, beside in zip(mine, its, strict=True)]


def while_on(figures: Values) -> str:
    """Return a sentence on the rms displacement of all mounts while the friction damper was on."""
    key = 'displacement_rms_while_friction_is_on_m'
    values = {name: each[key] for name, each in figures['runs'].items()}
    if values[FRICTION] is None:
        return 'Damping was never on: the displacement did not stay above the switch-on level long enough.'
    told = ', '.join(f'{name} {1e3 * value:.2f} mm' for name, value in values.items())
    return f'In the seconds in which damping was on, the rms displacements are: {told}.'


NAME = 'recorded_drive'
_MOUNTS = {FRICTION: 'friction', HYDRO: 'hydro', ELASTOMER: 'elastomer'}


class RecordedDriveParameters(NamedTuple):
    """Where the recorded acceleration stands, as in the scenario `recorded`; and the characteristic."""

    file: str = ''
    column: str = ''
    time_column: str = ''
    topic: str = ''
    scale: AccelerationScale = 1.0
    duration: Annotated[float, Quantity('s', 'so much from its beginning; 0: all of it', 0.0, 3600.0)] = 0.0
    damper: str = switched_viscous.DEFAULT_DAMPER


def run(order: Order, progress: Progress) -> Outcome:
    """Drive every mount on the recording, and evaluate spectra and bands."""

    parameters = parameters_of(order, NAME, RecordedDriveParameters())
    if not parameters.file:
        raise ExperimentError(
            f'{NAME} needs a recorded vertical acceleration (CSV, MCAP, or a folder of NPY pairs): give '
            f'--set {NAME}.file=FILE, its --set {NAME}.column=NAME, and --set {NAME}.scale=-1 where its axis '
            'points down'
        )
    if 0.0 < parameters.duration < SHORTEST:
        raise ExperimentError(
            f'{NAME}.duration ({parameters.duration:g} s) must be at least {SHORTEST:.1f} s for a spectrum, '
            'or 0 for all of the recording'
        )
    damper_curve(parameters.damper)  # refuses an unknown one before anything is made
    rate = recorded_signal(_scenario(parameters)).rate  # refuses what cannot be read
    control = with_flattened(switched_viscous.Parameters(), order.settings.get('mount_control', {}))
    drives = {}
    for number, (name, mount) in enumerate(_MOUNTS.items()):
        progress(0.95 * number / len(_MOUNTS), name)
        drives[name] = driven(order, name.replace(' ', '_'), _own(parameters, mount), NAME)
    progress(0.95, 'pictures')
    spectra = {name: spectra_of(each) for name, each in drives.items()}
    figures = _figures(drives, parameters, control, mode_of(order))
    pictures = [
        draw_spectra(spectra, order.out / 'recorded_drive_spectra.png'),
        draw_traces(drives, control, order.out / 'recorded_drive.png'),
    ]
    page = write_recorded_drive(figures, pictures, rate, order.out / f'{NAME}.md')
    recordings = [each.recording for each in drives.values()]
    return Outcome(figures, pictures, recordings, statements(figures), [page])


def _scenario(parameters: RecordedDriveParameters) -> RecordedScenario:
    return RecordedScenario(*(getattr(parameters, name) for name in RecordedScenario._fields))


def _own(parameters: RecordedDriveParameters, mount: str) -> Settings:
    return {
        'mount_sim': {
            'scenario': 'recorded',
            'mount': mount,
            'timeline.duration': parameters.duration,
            **{f'recorded.{name}': value for name, value in _scenario(parameters)._asdict().items()},
            'recorded.file': str(Path(parameters.file).absolute()),
        },
        'mount_control': {'policy': PAPER, 'damper': parameters.damper},
    }


def _figures(
    drives: dict[str, DriveSignals],
    parameters: RecordedDriveParameters,
    control: switched_viscous.Parameters,
    mode: str,
) -> Values:
    seen, truth = drives[FRICTION].seen, drives[FRICTION].truth
    active = np.interp(truth.time, seen.time, seen.damping_active.astype(float)) > 0.5
    events = near(active, 1.0 / control.eigenfrequency)
    changes = switching(seen)
    return {
        'source': Path(parameters.file).name,
        'column': parameters.column,
        'scale': parameters.scale,
        'duration_s': float(truth.time[-1] - truth.time[0] + SAMPLE_TIME),
        'acceleration_rms_m_s2': _rms(truth.chassis_acceleration),
        'acceleration_band_rms_m_s2': rms_in_bands(truth.chassis_acceleration, BANDS),
        'damper': parameters.damper,
        'switch_on_level_m': control.switch_on_level,
        'switch_off_level_m': control.switch_off_level,
        'times_on': len(changes.on),
        'switched_on_s': list(changes.on),
        'switched_off_s': list(changes.off),
        'damping_active_share': float(np.mean(active)),
        'events_share': float(np.mean(events)),
        'events_margin_s': 1.0 / control.eigenfrequency,
        'bands_hz': [list(band) for band in BANDS],
        'mode': mode,
        'runs': {name: _figures_of(each.truth, active, events) for name, each in drives.items()},
    }


def _figures_of(truth: Truth, active: BoolArray, events: BoolArray) -> Values:
    return {
        'displacement_rms_m': _rms(truth.displacement),
        'displacement_peak_m': float(np.max(np.abs(truth.displacement))),
        'displacement_rms_while_friction_is_on_m': _rms(truth.displacement[active]),
        **_bands_of('displacement', 'm', truth.displacement, events),
        'force_rms_n': _rms(truth.mount_force),
        'force_peak_n': float(np.max(np.abs(truth.mount_force))),
        **_bands_of('force', 'n', truth.mount_force, events),
    }


def _bands_of(name: str, unit: str, values: FloatArray, events: BoolArray) -> Values:
    return {
        f'{name}_band_rms_{unit}': rms_in_bands(values, BANDS),
        f'{name}_band_rms_at_events_{unit}': rms_in_bands_within(values, events),
        f'{name}_band_rms_else_{unit}': rms_in_bands_within(values, ~events),
    }


def _rms(values: FloatArray) -> float | None:
    """Return the rms about 0, None of nothing."""
    return float(np.sqrt(np.mean(values**2))) if len(values) else None


def statements(figures: Values) -> list[Statement]:
    """Return what the paper says about good roads, each with what these figures say to it."""
    return [_on_isolation(figures), _on_displacement(figures)]


def _on_isolation(figures: Values) -> Statement:
    force = ratios(figures, 'force_band_rms_else_n')
    displacement = ratios(figures, 'displacement_band_rms_else_m')
    return Statement(
        'Secs. 1, 7',
        'On good roads the mount is a soft spring without damping and performs better than a classical one.',
        f'Away from the moments of damping, rms over that of the hydromount: force on the chassis '
        f'{_by_band(figures, force)}; displacement {_by_band(figures, displacement)}. Holds if force and '
        'displacement are lower from 5 Hz on; the chassis moves as recorded whatever the force.',
        holds_if_lower([*force[1:], *displacement[1:]]),
    )


def _on_displacement(figures: Values) -> Statement:
    hydro = ratios(figures, 'displacement_band_rms_at_events_m')
    soft = ratios(figures, 'displacement_band_rms_at_events_m', ELASTOMER)
    return Statement(
        'Sec. 7',
        'Lower displacements when damping is on.',
        f'Damping was on {figures["times_on"]} times, {100 * figures["damping_active_share"]:.1f} % of the '
        f'drive. At these moments, rms over that of the hydromount: {_by_band(figures, hydro)}; over that of '
        f'the elastomer alone: {_by_band(figures, soft)}. Holds if lower than the hydromount, 5 to 12 Hz.',
        holds_if_lower(hydro[1:2]),
    )


def _by_band(figures: Values, values: list[float]) -> str:
    if not values:
        return 'unknown, for damping was never on'
    return ', '.join(
        f'{value:.2f} ({low:g} to {high:g} Hz)'
        for (low, high), value in zip(figures['bands_hz'], values, strict=True)
    )


_HEAD = """# A recorded drive: friction mount, hydromount, elastomer alone

`engine-mount experiment recorded_drive` writes this page from its numbers; nobody edits it. `make
experiments` writes it anew where the recording lies beside this repository, in
`../shared/data/motorway_i280`; elsewhere it stays as it was last written. The recording is not part of this
project. Any other vertical acceleration (CSV, NPY, MCAP) can take its place:

```
engine-mount experiment recorded_drive --set recorded_drive.file=drive.csv --set recorded_drive.column=az \\
  --set recorded_drive.scale=-1
```
"""
_LIMITS = """## Limits of this comparison

- **The sensor is not at the mount.** The recording of the I-280 is that of a device behind the windscreen.
  What it feels there, after body, holder and its own noise, is taken as the motion of the chassis at the
  engine mount.
- **It was measured under another engine mount.** What that car's own engine and mounts did to the body is in
  the recording already, and is no excitation by the road.
- **Its bandwidth is small.** It has {rate}: nothing above {nyquist} is known, and what lay above may
  be folded below. Of the acoustics, up to 400 Hz, it tells nothing; no engine vibration is added.
- **No feedback from force to chassis.** The chassis moves as recorded, whatever the mount does. So its
  acceleration is the same with all mounts, and the force on it is compared instead. A mount that pushes more
  would in a car also move the chassis, and be moved by it.
- **The hydromount's parameters are chosen**, as are the elastomer's and the engine's mass: magnitudes as in
  the literature, not those of this car nor those of the authors. What depends on them:
  [results.md](results.md).
- **Friction acts only after the displacement left {level} for one period.** Such events are few in one drive:
  a figure over the whole of it mostly compares a soft spring with a hydromount, and figures of the events
  stand on a handful of them.
"""


def write_recorded_drive(figures: Values, pictures: Sequence[Path], rate: float, file: Path) -> Path:
    """Write the page to `file` and return it; `rate` (Hz) is that of the recording's sensor.

    Its pictures are expected in `figures/`.
    """
    spectra, traces = (picture.name for picture in pictures)
    parts = [
        _HEAD,
        _drive(figures, rate),
        '## In short\n',
        _in_short(figures),
        '## Spectra and bands\n',
        f'![Spectra of displacement and force](figures/{spectra})\n',
        _parts(figures),
        _bands(figures, 'displacement', 'displacement', 'm', 1e3),
        _bands(figures, 'force on the chassis', 'force', 'n', 1.0),
        '## When damping was on\n',
        f'![Displacement over time](figures/{traces})\n',
        _events(figures),
        _LIMITS.format(
            rate=f'{rate:.0f} samples per second',
            nyquist=f'{rate / 2.0:.0f} Hz',
            level=f'{1e3 * figures["switch_on_level_m"]:g} mm',
        ),
    ]
    return write_page(parts, file)


def _drive(figures: Values, rate: float) -> str:
    bands = ', '.join(
        f'{value:.3f} m/s^2 from {low:g} to {high:g} Hz'
        for (low, high), value in zip(figures['bands_hz'], figures['acceleration_band_rms_m_s2'], strict=True)
    )
    column = f', `{figures["column"]}`' if figures['column'] else ''
    return (
        f'Driven: `{figures["source"]}`{column}, times {figures["scale"]:g}, '
        f'{figures["duration_s"]:.1f} s at {rate:.0f} samples per second, without its mean. '
        f'Acceleration, rms: {bands}. Damper {figures["damper"]}; mode {figures["mode"]}.\n'
    )


def _in_short(figures: Values) -> str:
    lines = []
    for where, suffix in (('At the moments of damping', 'at_events'), ('Else', 'else')):
        for what, unit in (('displacement', 'm'), ('force', 'n')):
            key = f'{what}_band_rms_{suffix}_{unit}'
            told = [
                f'{low:g} to {high:g} Hz {hydro:.2f} of the hydromount, {soft:.2f} of the elastomer alone'
                for (low, high), hydro, soft in zip(
                    figures['bands_hz'], ratios(figures, key), ratios(figures, key, ELASTOMER), strict=False
                )
            ]
            if told:
                lines.append(f'- **{where}, {what}** with the friction mount, rms: {"; ".join(told)}.')
    peaks = {name: 1e3 * each['displacement_peak_m'] for name, each in figures['runs'].items()}
    listed = ', '.join(f'{name} {peak:.2f} mm' for name, peak in peaks.items())
    lines.append(f'- **Largest displacement**: {listed}.')
    return '\n'.join(lines) + '\n'


def _bands(figures: Values, what: str, name: str, unit: str, scale: float) -> str:
    bands = [f'{low:g} to {high:g} Hz' for low, high in figures['bands_hz']]
    shown = {'m': 'mm', 'n': 'N'}[unit]
    lines = [
        f'Rms of the {what} in {shown}:\n',
        '| part of the drive | mount | ' + ' | '.join(bands) + ' |',
        '|---|---|' + '---|' * len(bands),
    ]
    for part, suffix in (('whole', ''), ('moments of damping', 'at_events_'), ('the rest', 'else_')):
        for mount in (FRICTION, HYDRO, ELASTOMER):
            values = figures['runs'][mount][f'{name}_band_rms_{suffix}{unit}']
            if values is not None:
                cells = ' | '.join(f'{scale * value:.3g}' for value in values)
                lines.append(f'| {part} | {mount} | {cells} |')
    return '\n'.join(lines) + '\n'


def _parts(figures: Values) -> str:
    return (
        f'Moments of damping are those with the friction damper on, and {figures["events_margin_s"]:.3f} s '
        f'before and behind: {100.0 * figures["events_share"]:.1f} % of the drive, the same ones for all '
        'mounts. In the rest the friction mount is the elastomer alone. The whole is from its spectrum, the '
        'parts are by a band-pass that halves the amplitude at the edges of a band; so they do not add up.\n'
    )


def _events(figures: Values) -> str:
    share = 100.0 * figures['damping_active_share']
    return (
        f'Damping went on {figures["times_on"]} times and was on for {share:.1f} % of the drive '
        f'(switch-on level {1e3 * figures["switch_on_level_m"]:g} mm). {while_on(figures)}\n'
    )


_LOWEST, _HIGHEST = 0.7, 45.0  # Hz, chosen: what the bands lie in, and no more than a car's sensor has
_BEFORE, _AFTER = 1.0, 4.0  # s round the largest displacement


def draw_spectra(spectra: dict[str, Spectra], file: Path) -> Path:
    """Draw displacement and chassis-side force of all mounts over frequency, the bands behind them."""
    figure = new_figure('A recorded drive: displacement of the mount and its force on the chassis', 7.5)
    panels = figure.subplots(2, 1, sharex=True)
    for axes, name, scale, label in (
        (panels[0], 'displacement', 1e6, 'displacement (µm/$\\sqrt{\\mathrm{Hz}}$)'),
        (panels[1], 'force', 1.0, 'force on the chassis (N/$\\sqrt{\\mathrm{Hz}}$)'),
    ):
        for (mount, colour, dash), width in zip(_styles(), (1.6, 1.4, 1.4), strict=True):
            each = spectra[mount]
            shown = (each.frequency >= _LOWEST) & (each.frequency <= _HIGHEST)
            values = scale * getattr(each, name)[shown]
            axes.loglog(
                each.frequency[shown], values, color=colour, linestyle=dash, linewidth=width, label=mount
            )
        for edge in sorted({edge for band in BANDS for edge in band}):
            axes.axvline(edge, color=GREY, linewidth=0.8, linestyle='-.')
        axes.set_ylabel(label)
    ticks = [1, 2, 5, 8, 12, 20, 30]
    panels[1].set_xticks(ticks, [f'{tick:g}' for tick in ticks])
    panels[1].set_xticks([], minor=True)
    panels[1].set_xlim(_LOWEST, _HIGHEST)
    panels[1].set_xlabel('frequency (Hz); vertical lines: edges of the bands')
    panels[0].legend(loc='lower left')
    return finish(figure, file)


def draw_traces(drives: dict[str, DriveSignals], control: switched_viscous.Parameters, file: Path) -> Path:
    """Draw the whole drive above, the seconds round its largest displacement below."""
    seen, truth = drives[FRICTION].seen, drives[FRICTION].truth
    middle = float(truth.time[np.argmax(np.abs(truth.displacement))])
    figure = new_figure('A recorded drive: displacement of the mount over time', 7.5)
    upper, lower = figure.subplots(2, 1)
    upper.plot(truth.time, 1e3 * truth.displacement, color=BLUE, linewidth=0.6, label=FRICTION)
    begin, end = max(0.0, middle - _BEFORE), middle + _AFTER
    for (name, colour, dash), width in zip(_styles(), (1.4, 1.2, 1.8), strict=True):
        each = drives[name].truth
        shown = (each.time >= begin) & (each.time <= end)
        lower.plot(
            each.time[shown], 1e3 * each.displacement[shown], color=colour, linestyle=dash,
            linewidth=width, label=name,
        )  # fmt: skip
    for axes, whole in ((upper, True), (lower, False)):
        within = (seen.time >= 0.0) if whole else (seen.time >= begin) & (seen.time <= end)
        axes.fill_between(
            seen.time[within], 0.0, 1.0, where=seen.damping_active[within], color=GREY, alpha=0.18,
            transform=axes.get_xaxis_transform(), label='damping on', step='post', linewidth=0.0,
        )  # fmt: skip
        for sign in (1.0, -1.0):
            axes.axhline(
                1e3 * sign * control.switch_on_level, color=RED, linestyle='--', linewidth=0.9,
                label='switch-on level' if sign > 0.0 else None,
            )  # fmt: skip
        axes.set_ylabel('displacement (mm)')
        axes.set_xlabel('time from the start of the drive (s)')
        axes.legend(loc='upper right', ncols=3, fontsize='small')
    # room for the legend
    upper.set_ylim(top=1.4e3 * float(np.max(np.abs(truth.displacement))))
    upper.set_xlim(0.0, float(truth.time[-1]))
    lower.set_xlim(begin, end)
    return finish(figure, file)


def _styles() -> list[tuple[str, str, str]]:
    """Return mount, colour and dash, the one that lies on top last."""
    return [(ELASTOMER, UNDAMPED_COLOUR, ':'), (HYDRO, HYDROMOUNT_COLOUR, '--'), (FRICTION, BLUE, '-')]


EXPERIMENT = Experiment(
    NAME,
    *NAMES[NAME],
    (
        'The vertical acceleration that a real car recorded moves the chassis side of the mount, with '
        'friction mount, original hydromount and elastomer alone in the seat. Spectra and bands come from '
        'the recordings of these runs.'
    ),
    RecordedDriveParameters(),
    run,
    closed_loop=True,
    needs='file',
)
