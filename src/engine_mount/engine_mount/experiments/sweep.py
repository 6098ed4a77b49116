"""Fig. 14: the front wheels on a sine of rising frequency; displacement, chassis acceleration."""

from typing import Annotated, Any, NamedTuple

import numpy as np

from engine_mount.experiments.harness.closed_loop import drive_cases, paper_policy
from engine_mount.experiments.harness.drawing import BLUE, COLOURS, HYDRO_LINE, OFF_LINE, new_panels
from engine_mount.experiments.harness.experiment import (
    NOT_COMPARABLE,
    OURS,
    PAPER,
    PARTLY,
    Experiment,
    Findings,
    Order,
    Values,
    claim,
    holds_if,
)
from engine_mount.experiments.harness.measures import (
    BELOW_ISOLATION,
    FIRST_FREQUENCY,
    ISOLATION_BANDS,
    RATE,
    Band,
    highest_per_band,
    peak_in,
    rms_in,
    sweep_parameters,
)
from engine_mount.reports.drive.signals import DriveSignals, FloatArray, switching
from mount_control.policy.switched_viscous import DEFAULT_DAMPER
from mount_models.quantity import Quantity

NAME = 'sweep'
FRICTION, HYDRO, OFF, ALWAYS = 'friction', 'hydromount', 'friction, 0 A', 'friction, always on'
_MOUNTS = {FRICTION: 'friction', HYDRO: 'hydro', OFF: 'friction_off', ALWAYS: 'friction_always_on'}
RESONANCE = (7.0, 10.0)  # Hz
DEFINED_PEAK = 1.25
"""A local maximum of the displacement over frequency is a resonance peak if it exceeds the switch-on level by
this factor (chosen); below it the switched mount cannot damp."""
FAR_HIGHER = 0.75
"""Damping counts as far higher if it leaves less than this share of the other's displacement (chosen)."""


class SweepParameters(NamedTuple):
    """The road and the damper characteristic."""

    velocity_amplitude: Annotated[float, Quantity('m/s', 'V0: vertical velocity of the road', 0.001, 1.0)] = (
        0.12
    )
    last_frequency: Annotated[float, Quantity('Hz', 'end of the sweep', 4.0, 50.0, 'Sec. 6')] = 50.0
    damper: str = DEFAULT_DAMPER


def run(order: Order) -> Findings:
    """Drive every mount through the sweep, record it, and evaluate the recordings."""
    own = order.parameters
    road = sweep_parameters(own.velocity_amplitude, own.last_frequency)
    drives = drive_cases(order, {name: {**road, 'mount': mount} for name, mount in _MOUNTS.items()})
    level = paper_policy(order).switch_on_level
    runs = {name: figures_of(each, level) for name, each in drives.items()}
    figures = {
        'road_level_m_per_s': own.velocity_amplitude,
        'damper': own.damper,
        'switch_on_level_m': level,
        'runs': runs,
    }
    return Findings(figures, {'sweep': draw_sweep(drives)}, [each.recording for each in drives.values()])


def _frequency(drive: DriveSignals) -> FloatArray:
    return FIRST_FREQUENCY + RATE * drive.truth.time


def figures_of(drive: DriveSignals, level: float) -> Values:
    """Return peaks, rms and switching frequencies of one run; `level` (m) is that of switching on."""
    truth, frequency = drive.truth, _frequency(drive)
    middles, peaks = (each.tolist() for each in highest_per_band(frequency, truth.displacement, 1.0))
    changes = switching(drive.seen)
    return {
        'bands_hz': middles,
        'peak_displacement_m': peaks,
        'resonance_peak_m': peak_in(frequency, truth.displacement, RESONANCE),
        'highest_peak_m': peak_in(frequency, truth.displacement, BELOW_ISOLATION),
        'defined_peak': defined_peak(middles, peaks, level),
        'isolation_rms': [rms_in(frequency, truth.chassis_acceleration, band) for band in ISOLATION_BANDS],
        'switched_on_hz': [FIRST_FREQUENCY + RATE * time for time in changes.on],
        'switched_off_hz': [FIRST_FREQUENCY + RATE * time for time in changes.off],
    }


def defined_peak(middles: list[float], peaks: list[float], level: float) -> Band | None:
    """Return (middle of its band Hz, height m) of the highest resonance peak, None for none."""
    inner = [
        (middles[k], peaks[k])
        for k in range(1, len(peaks) - 1)
        if peaks[k] > max(peaks[k - 1], peaks[k + 1], DEFINED_PEAK * level)
    ]
    return max(inner, key=lambda found: found[1], default=None)


def _peak_told(figures: Values, name: str) -> str:
    found, limit = figures['runs'][name]['defined_peak'], 1e3 * DEFINED_PEAK * figures['switch_on_level_m']
    told = 'no such peak' if found is None else f'a peak of {1e3 * found[1]:.2f} mm near {found[0]:.1f} Hz'
    return f'{told}, counted from {limit:.2f} mm on (chosen)'


@claim('Fig. 14', paper='With the original mount the displacement shows a clear resonance peak.')
def _on_peak_of_hydro(figures):
    told = f"""The hydromount shows {_peak_told(figures, HYDRO)}. Its height grows with the road level, which
        the paper does not give."""
    return figures['runs'][HYDRO]['defined_peak'], told


@claim('Fig. 14', paper='With the friction mount no defined resonance peak is visible.')
def _on_peak_of_friction(figures):
    chosen = figures['runs'][FRICTION]
    peaks, on, off = (chosen[key] for key in ('peak_displacement_m', 'switched_on_hz', 'switched_off_hz'))
    where = chosen['bands_hz'][int(np.argmax(peaks))]
    end = f' and off at {off[-1]:.1f} Hz' if off else ''
    switched = f'damping on at {on[0]:.1f} Hz{end}' if on else 'damping never on'
    told = f"""It shows {_peak_told(figures, FRICTION)}; its highest displacement is {1e3 * max(peaks):.2f} mm
        between {where - 0.5:.0f} and {where + 0.5:.0f} Hz, {switched}."""
    return chosen['defined_peak'] is None, told


@claim('Fig. 14', paper='The damping of the friction mount round the resonance is far higher.')
def _on_damping(figures):
    peaks = {name: figures['runs'][name]['resonance_peak_m'] for name in (FRICTION, HYDRO, OFF, ALWAYS)}
    if None in peaks.values():
        return NOT_COMPARABLE, 'The sweep ends before 10 Hz.'
    share = peaks[FRICTION] / peaks[HYDRO]
    told = f"""Largest displacement from 7 to 10 Hz in mm:
        {', '.join(f'{name} {1e3 * peak:.2f}' for name, peak in peaks.items())}. So {share:.2f} of the
        hydromount; damping always on leaves {peaks[ALWAYS] / peaks[OFF]:.2f} of the undamped one. Counted as
        far higher below {FAR_HIGHER:g} of the hydromount (chosen). Against the hydromount this depends on
        the road level (docs/explanation/policy.md)."""
    return share < FAR_HIGHER or (share < 1.0 and PARTLY), told


@claim(
    'Fig. 14; Sec. 6',
    paper='At higher frequencies, where damping is off, the acceleration of the chassis is lower.',
)
def _on_noise(figures):
    pairs = zip(*(figures['runs'][name]['isolation_rms'] for name in (FRICTION, HYDRO)), strict=True)
    ratios = {
        band: ours / its for band, (ours, its) in zip(ISOLATION_BANDS, pairs, strict=True) if ours is not None
    }
    if not ratios:
        return NOT_COMPARABLE, 'The sweep ends before 20 Hz.'
    texts = (f'{ratio:.2f} ({low:.0f} to {high:.0f} Hz)' for (low, high), ratio in ratios.items())
    told = f"""Rms of the friction mount over that of the hydromount, engine off: {', '.join(texts)}. The
        paper gives neither the road level nor whether the engine ran; with an idling engine and on other
        roads: docs/explanation/policy.md."""
    return holds_if([ratio < 1.0 for ratio in ratios.values()]), told


def draw_sweep(drives: dict[str, DriveSignals]) -> Any:
    """Draw displacement and chassis acceleration over frequency, as envelopes, Fig. 14."""
    figure, panels = new_panels(
        'Front wheels on a sweep of 1 Hz per second (Fig. 14)', 2, height=6.5, sharex=True
    )
    for axes, label, scale, name in (
        (panels[0], 'displacement, envelope (mm)', 1e3, 'displacement'),
        (panels[1], 'chassis acceleration,\nenvelope (m/s$^2$)', 1.0, 'chassis_acceleration'),
    ):
        for mount, style in (
            (OFF, OFF_LINE),
            (HYDRO, HYDRO_LINE),
            (ALWAYS, {'color': COLOURS[1]}),
            (FRICTION, {'color': BLUE}),
        ):
            drive = drives[mount]
            envelope = highest_per_band(_frequency(drive), scale * getattr(drive.truth, name), 0.25)
            axes.plot(*envelope, label=mount, **style)
        axes.set_ylabel(label)
    panels[1].set_xlabel('frequency of the road (Hz)')
    panels[0].legend(loc='upper right')
    return figure


EXPERIMENT = Experiment(
    NAME,
    """The road under the wheel is a sine whose frequency rises by 1 Hz per second at a constant amplitude
    of its velocity (chosen). The same sweep is driven with the friction mount, the original
    hydromount, and the friction mount without current and with damping always on; displacement and
    chassis acceleration come from the recordings. The better of the two mounts depends on values that the
    paper does not give: docs/explanation/policy.md.""",
    SweepParameters(),
    run,
    closed_loop=True,
    policies=(PAPER, OURS),
)
