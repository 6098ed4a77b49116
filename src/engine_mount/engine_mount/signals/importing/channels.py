"""Signals in SI as they are recorded: those that drive something at its rate, others as sampled."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from engine_mount.signals.even_grid import EvenSignal, evenly_spaced
from engine_mount.signals.excitation import LOWEST_RATE as LOWEST_RATE_OF_ACCELERATION
from engine_mount.signals.quantities import QUANTITIES, Quantity
from engine_mount.signals.resampling import has_step, resampled
from engine_mount.signals.signal import SECOND, FloatArray, Signal, SignalError, check_size
from mount_control.settings import ControlParameters
from mount_models.sampling import SAMPLE_RATE, sample_time_ns
from mount_ros import topics
from mount_ros.messages.cdr import accelerometer
from mount_ros.messages.scalars import OneNumberLayout, Rows, ScalarsLayout
from mount_ros.topics import JOINT_STATE, Delivery, Scalar, Topic

DISPLACEMENT, ENGINE, CHASSIS = 'displacement', 'engine_displacement', 'chassis_displacement'
ACCELERATION = 'acceleration'
LOWEST_RATE = 100.0  # Hz, chosen: five times the 20 Hz up to which an engine moves on its mounts
SHORTEST = 0.5  # s, chosen: four periods of the band
LONGEST_GAP = 0.125
"""s: one period of the 8 Hz at which an engine moves on its mounts cannot be interpolated."""
PREFIX = 'measured/'
"""The beginning of topics that only foreign recordings have."""
Times = NDArray[np.int64]


@dataclass(frozen=True)
class RecordedAs:
    """The topic and the field of its messages that hold a quantity."""

    topic: Topic
    field: str

    def rows(self, stamps: Times, values: FloatArray) -> Rows:
        """Return the messages of `stamps` (ns) and `values` (n,), SI, as bytes."""
        if self.topic.type == JOINT_STATE:
            return ScalarsLayout(self.topic).pack_rows(stamps, values[:, None])
        return OneNumberLayout(accelerometer).pack_rows(stamps, values)


@dataclass(frozen=True, eq=False)
class Channel:
    """What is written under one topic: stamps (ns, rising) and values (n,) in the SI unit `unit`."""

    place: RecordedAs
    unit: str
    stamps: Times
    values: FloatArray


def recorded_as(wanted: Quantity) -> RecordedAs:
    """Return where a quantity is recorded: displacement and acceleration where every command takes them."""
    if wanted.name == DISPLACEMENT:
        return RecordedAs(topics.DISPLACEMENT, topics.DISPLACEMENT.names[0])
    if wanted.name == ACCELERATION:
        return RecordedAs(topics.SIM_CHASSIS_ACCELERATION, 'linear_acceleration.z')
    scalar = Scalar(wanted.name, wanted.unit.symbol)
    topic = Topic(PREFIX + wanted.name, JOINT_STATE, Delivery.STREAM, 0.0, wanted.sentence, (scalar,))
    return RecordedAs(topic, wanted.name)


def channels_of(
    signals: Mapping[str, Signal], quantities: Mapping[str, Quantity]
) -> tuple[list[Channel], list[str]]:
    """Return what is recorded of `signals` (SI, without long gaps), and sentences on what was done.

    Raises `SignalError` for what no command could follow.
    """
    notes: list[str] = []
    found: dict[str, tuple[Times, FloatArray]] = {}
    ends = (DISPLACEMENT,) if DISPLACEMENT in signals else (ENGINE, CHASSIS)
    if all(name in signals for name in ends):
        found[DISPLACEMENT] = _displacement({name: signals[name] for name in ends}, notes)
    for name, signal in signals.items():
        if name == ACCELERATION:
            found[name] = _acceleration(signal, notes)
        elif name != DISPLACEMENT:
            found[name] = _as_sampled(signal)
    wanted = {name: quantities.get(name) or QUANTITIES[name] for name in found}
    return [
        Channel(recorded_as(wanted[name]), wanted[name].unit.symbol, *pair) for name, pair in found.items()
    ], list(dict.fromkeys(notes))


def displacement_on_grid(
    signals: Mapping[str, EvenSignal], sample_rate: float, notes: list[str]
) -> tuple[Times, FloatArray]:
    """Return stamps (ns) of `sample_rate` (Hz) and the displacement on them, in the unit of the signals.

    `signals` are {`displacement`: signal} or those of engine and chassis, whose difference it is. Adds what
    was done to `notes`; raises `SignalError`.
    """
    step, step_ns = 1.0 / sample_rate, sample_time_ns(sample_rate)
    begin = max(even.begin for even in signals.values())
    end = min(even.begin + round(even.length * SECOND) for even in signals.values())
    count = round((end - begin) / step_ns) + 1
    if count * step < SHORTEST:
        spans = '; '.join(
            f'{even.name}: {even.begin / 1e9:.3f} .. {even.begin / 1e9 + even.length:.3f} s'
            for even in signals.values()
        )
        raise SignalError(f'no overlap of {SHORTEST:g} s or more: {spans}')
    values = {
        name: resampled(even, step, (begin - even.begin) / SECOND, count)[:] for name, even in signals.items()
    }
    for even in signals.values():
        _note_resampling(even, sample_rate, notes)
    stamps = np.arange(begin, begin + count * step_ns, step_ns, dtype=np.int64)
    return stamps, values[DISPLACEMENT] if DISPLACEMENT in values else values[ENGINE] - values[CHASSIS]


def rate_text(sample_rate: float) -> str:
    """Return a sample rate (Hz) in words."""
    return f'{sample_rate / 1000.0:g} kHz'


def _note_resampling(even: EvenSignal, sample_rate: float, notes: list[str]) -> None:
    if not has_step(even, 1.0 / sample_rate):
        rates = f'from {even.rate:.4g} Hz to {rate_text(sample_rate)}'
        notes.append(f'{even.name}: resampled {rates}, band-limited')


def _displacement(signals: Mapping[str, Signal], notes: list[str]) -> tuple[Times, FloatArray]:
    even = {name: evenly_spaced(signal, LONGEST_GAP, LOWEST_RATE) for name, signal in signals.items()}
    for one in even.values():
        notes += one.notes
    stamps, values = displacement_on_grid(even, SAMPLE_RATE, notes)
    check_size(
        ' and '.join(one.name for one in even.values()), values, 1.0 / SAMPLE_RATE,
        ControlParameters().displacement_range, 'm',
        'is its unit another one, its zero another offset (in a mapping file), or is this sample a fault to '
        'cut out?',
    )  # fmt: skip
    return stamps, values


def _acceleration(signal: Signal, notes: list[str]) -> tuple[Times, FloatArray]:
    """Return the acceleration at the rate that its topic has."""
    even = evenly_spaced(signal, LONGEST_GAP, LOWEST_RATE_OF_ACCELERATION)
    notes += even.notes
    _note_resampling(even, SAMPLE_RATE, notes)
    step, step_ns = 1.0 / SAMPLE_RATE, sample_time_ns(SAMPLE_RATE)
    values = resampled(even, step, 0.0, round(even.length / step) + 1)[:]
    return np.arange(even.begin, even.begin + values.size * step_ns, step_ns, dtype=np.int64), values


def _as_sampled(signal: Signal) -> tuple[Times, FloatArray]:
    stamps = signal.begin + np.rint(SECOND * signal.times).astype(np.int64)
    back = np.flatnonzero(np.diff(stamps) < 0)
    if back.size:
        place = int(back[0])
        raise SignalError(
            f'{signal.name}: time goes back at sample {place + 1}, from {signal.times[place]:.6f} s to '
            f'{signal.times[place + 1]:.6f} s; sort the samples, or cut the file there'
        )
    return stamps, signal.values
