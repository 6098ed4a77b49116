"""How much the pads rub and are worn, over the starts of a car: a diagnosis, never an input of the law.

Wear is what the contact gap of each activation has lost. Friction comes from the policy `pad_probe`, whose
pulses press the pads with known normal forces N while the engine idles: its line in the displacement falls
from the amplitude a_0 to a. By the equation of motion a / a_0 depends on mu N / a_0 alone, as long as the
pads slide and the engine turns equally fast. So the first probe of a car is the curve, and the factor by
which the forces of another must be stretched to lie on it is its friction, whatever the idle force.
"""

from collections.abc import Sequence
from datetime import datetime
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.stats import linregress, t

from engine_mount.identification.fitting import FloatArray, IdentificationError
from engine_mount.recordings.recording import Recording, open_mount, recording_hash
from engine_mount.recordings.screen import Screen, Table
from engine_mount.recordings.session import started_of, told_session
from mount_control.engine_line import LOWEST_FREQUENCY, RESONATORS
from mount_init.checks import WEAR_RESERVE, wear_reserve
from mount_models.friction.coefficient import FrictionCoefficients, dynamic_coefficient
from mount_models.specimen import Specimen, chosen_specimen, friction_coefficients
from mount_ros.messages import force_table

SOUND = (0.85, 1.15)  # chosen: pads for which the default of `continuous_viscous` was chosen, see policy.md
_ENGINE = (LOWEST_FREQUENCY, LOWEST_FREQUENCY + RESONATORS - 1)  # Hz, as in the law
_SETTLED = 0.6  # chosen: share of pulse and pause, at its end, that is used; before, the engine swings freely
_SHORTEST = 1e8  # ns, chosen: less of a pulse shows no line
_PADDED = 1 << 15  # chosen: the lines of a spectrum lie 0.03 Hz apart
_SMALLEST_LINE = 8e-6  # m, chosen: four times the noise of the sensor
_SWING = (3.0, 16.0)  # Hz, chosen: where the engine swings on its mounts while the car moves
_LARGEST_SWING = 0.1  # chosen: over the line in the pause; measured 0.01 at rest, 0.7 on a road at 43 km/h
_SAME_SPEED = 0.05  # chosen: of the frequency of the first probe
_SPEED_ERROR = 2.2  # measured in simulation: error of the friction over that of the frequency, both relative
_FORCE_ERROR = 0.015  # measured in simulation: by the scatter of both tables of force
_STICKS, _FREE = 0.2, 0.95  # chosen: a / a_0 between which the pads slide and slow the engine
_CONFIDENCE = 0.95
_NEVER = 1 << 62  # ns


class Probe(NamedTuple):
    """Frequency (Hz) of the engine's line; of each pulse N (N), a (m), a_0 (m) of the pause before it."""

    frequency: float
    normal_force: FloatArray
    pressed: FloatArray
    free: FloatArray


class Start(NamedTuple):
    """What one activation measured: gaps in m, friction over that in the first probe with its deviation."""

    name: str
    time: datetime | None
    contact_gap: float
    contact_gap_std: float
    wear_reserve: float
    probe: Probe | None = None
    note: str = ''
    friction: tuple[float, float] | None = None


class Trend(NamedTuple):
    """Change a start, by a straight line through all, and half of the interval in which it surely lies."""

    slope: float
    interval: float


class PadHistory:
    """The pads over the starts of a car."""

    def __init__(self, starts: Sequence[Start]):
        self.starts = starts
        self.wear = trend([start.contact_gap for start in starts])
        self.friction = trend([start.friction and start.friction[0] for start in starts])

    def sentences(self) -> list[str]:
        """Return what wear and friction have become: value, limit and remedy."""
        last = self.starts[-1]
        lost, reserve = 1e6 * (self.starts[0].contact_gap - last.contact_gap), 1e6 * last.wear_reserve
        worn = f'pads have lost {lost:.1f} um since the first start; {reserve:.0f} um are left'
        if last.wear_reserve < WEAR_RESERVE:
            worn += f' (limit {1e6 * WEAR_RESERVE:.0f} um): replace the pads'
        elif self.wear and self.wear.slope < -self.wear.interval:
            worn += f', for about {-last.wear_reserve / self.wear.slope:.0f} starts'
        probed = [start.friction for start in self.starts if start.friction]
        if not probed:
            return [worn, 'friction of the pads is unknown: record a start with the policy pad_probe']
        value, std = probed[-1]
        rubs = f'friction is {value:.2f} ± {std:.2f} of that in the first probe'
        if not SOUND[0] - 2.0 * std < value < SOUND[1] + 2.0 * std:
            rubs += (
                f' (limits {SOUND[0]} .. {SOUND[1]}): clean or replace the pads, or identify them on a rack '
                'with engine-mount identify friction'
            )
        return [worn, rubs]

    def figures(self) -> dict[str, Any]:
        """Return all figures, SI units."""
        starts = [
            {**start._asdict(), 'time': str(start.time), 'probe': start.probe and start.probe.frequency}
            for start in self.starts
        ]
        return {
            'starts': starts,
            'contact_gap_a_start': self.wear and self.wear._asdict(),
            'friction_a_start': self.friction and self.friction._asdict(),
            'conclusion': self.sentences(),
        }

    def report(self, screen: Screen) -> None:
        """Show the starts, their trends and the conclusion."""
        rows = [
            (
                start.name,
                f'{start.contact_gap * 1e6:.1f} ± {start.contact_gap_std * 1e6:.1f}',
                f'{start.wear_reserve * 1e6:.0f}',
                '{:.3f} ± {:.3f}'.format(*start.friction) if start.friction else '-',
            )
            for start in self.starts
        ]
        heads = ('start', 'contact gap (µm)', 'reserve (µm)', 'friction')
        screen.table(Table('', 'lrrr', rows, heads))
        for start in self.starts:
            if start.note:
                screen.note(f'{start.name}: {start.note}')
        for what, factor, found in (('contact gap, um', 1e6, self.wear), ('friction', 1.0, self.friction)):
            if found:
                slope, interval = factor * found.slope, factor * found.interval
                screen.say(f'{what}: {slope:+.3g} ± {interval:.2g} a start ({_CONFIDENCE:.0%} confidence)')
        for sentence in self.sentences():
            screen.say(sentence)

    def draw(self, file: Path) -> None:
        """Write the picture of gap and friction over the starts, and of all pulses, to `file` (PNG)."""
        from engine_mount.identification.pictures import draw_pads

        draw_pads(self, file)


def pads(recordings: Sequence[str | Path], *, mount: str = '', base: str | Path = '') -> PadHistory:
    """Return friction and wear of the pads of one mount in all starts of the recordings, in order of time.

    `mount` is the name of one of several; `base` the specimen file that init and control load, the shipped
    one without. Raises `IdentificationError`, and `ReadingError` of a recording.
    """
    specimen = chosen_specimen(str(base))
    seen: dict[str, Path] = {}
    starts: list[Start] = []
    for place in map(Path, recordings):
        recording = open_mount(place, mount)
        digest = recording_hash(recording.path)
        if digest in seen:
            raise IdentificationError(
                f'{place} and {seen[digest]} are the same to the bit: give each recording once'
            )
        seen[digest] = place
        starts += _starts_in(recording, specimen)
    if not starts:
        raise IdentificationError('0 recordings; give those of one car, the first start among them')
    starts.sort(key=lambda start: start.time.timestamp() if start.time else 0.0)
    reference = next((start.probe for start in starts if start.probe), None)
    coefs = friction_coefficients(specimen.friction)
    for number, start in enumerate(starts):
        if start.probe and reference:
            try:
                found = start._replace(friction=relative_friction(reference, start.probe, coefs))
            except IdentificationError as error:
                found = start._replace(note=str(error))
            starts[number] = found
    return PadHistory(starts)


def trend(values: Sequence[float | None]) -> Trend | None:
    """Return the trend of values (n,) with their places; None where fewer than three are known."""
    known = [(place, value) for place, value in enumerate(values) if value is not None]
    if len(known) < 3:
        return None
    line = linregress(*zip(*known, strict=True))
    return Trend(float(line.slope), float(line.stderr * t.ppf(0.5 + 0.5 * _CONFIDENCE, len(known) - 2)))


def relative_friction(reference: Probe, probe: Probe, coefs: FrictionCoefficients) -> tuple[float, float]:
    """Return the friction in `probe` over that in `reference`, and its standard deviation.

    The assumed friction at the velocity of the line is in the forces, since mu depends on it.
    """
    speed = probe.frequency / reference.frequency
    if abs(speed - 1.0) > _SAME_SPEED:
        raise IdentificationError(
            f'engine idled at {probe.frequency:.1f} Hz, at {reference.frequency:.1f} Hz in the first probe '
            f'(limit {_SAME_SPEED:.0%}): probe with a warm engine'
        )
    known_force, known_fall, _ = _curve(reference, coefs)
    force, fall, weight = _curve(probe, coefs)
    if known_fall.size < 3 or not (np.diff(known_fall) > 0.0).all():
        raise IdentificationError(
            f'{known_fall.size} pulses of the first probe slow the engine more and more (needed are 3): '
            'probe again with another pad_probe.friction_force'
        )
    shift = PchipInterpolator(known_fall, known_force, extrapolate=False)(fall) - force
    common = np.isfinite(shift)
    if np.count_nonzero(common) < 2:
        raise IdentificationError(
            f'{np.count_nonzero(common)} pulses slow the engine as those of the first probe do (needed are '
            '2): was its idling steady, the car at rest?'
        )
    shift, weight = shift[common], weight[common] / weight[common].sum()
    mean = weight @ shift
    scatter = np.sqrt(weight @ (shift - mean) ** 2 / (shift.size - 1))
    std = np.linalg.norm([scatter, _FORCE_ERROR, _SPEED_ERROR * np.log(speed)])
    return float(np.exp(mean)), float(np.exp(mean) * std)


def _curve(probe: Probe, coefs: FrictionCoefficients) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return ln(mu N / a_0) in order, ln((a_0 / a)^2 - 1), and the weight of the pulses that slide."""
    ratio = probe.pressed / probe.free
    slides = np.flatnonzero((ratio > _STICKS) & (ratio < _FREE))
    slides = slides[np.argsort(probe.normal_force[slides])]
    force, ratio = probe.normal_force[slides], ratio[slides]
    speeds = 4.0 * probe.frequency * probe.pressed[slides]  # the mean of a sine's
    mu = [
        np.mean([dynamic_coefficient(coefs, way * speed, 0.0, load) for way in (1.0, -1.0)])
        for speed, load in zip(speeds, force, strict=True)
    ]
    fall = np.log(1.0 / ratio**2 - 1.0)
    return np.log(np.array(mu) * force / probe.free[slides]), fall, (ratio * (1.0 - ratio**2)) ** 2


def _starts_in(recording: Recording, specimen: Specimen) -> list[Start]:
    """Return the activations of a recording."""
    gaps, tables = recording['air_gap'], recording['current_force_table'].messages()
    forces = {table.stamp: float(table.normal_force[-1]) for table in map(force_table.from_message, tables)}
    places = {int(stamp): place for place, stamp in enumerate(gaps.stamps) if stamp in forces}
    if not places:
        raise IdentificationError(
            f'{recording.path} holds no activation with its table: record from the start of the car on'
        )
    time = started_of(told_session(recording), recording)
    starts: list[Start] = []
    for (stamp, place), end in zip(places.items(), [*list(places)[1:], _NEVER], strict=True):
        contact, std = (float(gaps[name][place]) for name in ('contact_gap', 'contact_gap_std'))
        name = recording.short_name.removesuffix('/recording')
        name += f' {len(starts) + 1}' if len(places) > 1 else ''
        start = Start(name, time, contact, std, wear_reserve(contact, forces[stamp], specimen))
        try:
            start = start._replace(probe=_probe_between(stamp, end, recording))
        except IdentificationError as error:
            start = start._replace(note=str(error))
        starts.append(start)
    return starts


def _probe_between(begin: int, end: int, recording: Recording) -> Probe | None:
    """Return the probe between two stamps (ns), None where none was tried; raises `IdentificationError`."""
    if 'control_trace' not in recording or 'pulse' not in recording['control_trace'].names:
        return None
    trace = recording['control_trace']
    part = (trace.stamps > begin) & (trace.stamps <= end)
    displacement, pulse, normal_force = (
        trace[name][part] for name in ('displacement', 'pulse', 'normal_force')
    )
    steps = np.diff(trace.stamps[part])
    period = float(np.median(steps)) if steps.size else 0.0
    changes = (np.diff(pulse) != 0.0) | (steps > 1.5 * period) | ~np.isfinite(displacement[1:])
    edges = [0, *(np.flatnonzero(changes) + 1), pulse.size]
    longest = max((last - first for first, last in pairwise(edges) if pulse[first:last].any()), default=0)
    used, pulses = round(_SETTLED * longest), []
    for before, first, last in zip(edges, edges[1:], edges[2:], strict=False):
        whole = first - before >= used > _SHORTEST / period and last - first > 0.9 * longest
        if whole and pulse[before] == 0.0 < pulse[first]:
            pause, rubbing = displacement[first - used : first], displacement[last - used : last]
            frequency, free = _line(pause, 1e-9 * period, _ENGINE)
            _, pressed = _line(rubbing, 1e-9 * period, (0.9 * frequency, 1.1 * frequency))
            _, swing = _line(rubbing, 1e-9 * period, _SWING)
            pulses.append((frequency, swing / free, normal_force[last - 1], pressed, free))
    if not pulses:
        raise IdentificationError('0 whole pulses of a probe: did the car move? Probe at standstill')
    frequencies, swings, forces, pressed, free = np.array(pulses).T
    if np.median(free) < _SMALLEST_LINE:
        raise IdentificationError(
            f"engine's line is {1e6 * np.median(free):.1f} um in the pauses of the probe (limit "
            f'{1e6 * _SMALLEST_LINE:.0f} um): probe with an idling engine'
        )
    if np.median(swings) > _LARGEST_SWING:
        raise IdentificationError(
            f'mount swings in a pulse by {np.median(swings):.0%} of the line (limit {_LARGEST_SWING:.0%}): '
            'probe at standstill'
        )
    return Probe(float(np.median(frequencies)), forces, pressed, free)


def _line(displacement: FloatArray, period: float, band: tuple[float, float]) -> tuple[float, float]:
    """Return frequency (Hz) and amplitude (m) of the largest line within a `band` (Hz)."""
    window = np.hanning(displacement.size)
    spectrum = np.abs(np.fft.rfft((displacement - displacement.mean()) * window, _PADDED))
    frequencies = np.fft.rfftfreq(_PADDED, period)
    inside = (frequencies >= band[0]) & (frequencies <= band[1])
    peak = int(np.argmax(np.where(inside, spectrum, 0.0)))
    return float(frequencies[peak]), float(2.0 * spectrum[peak] / window.sum())
