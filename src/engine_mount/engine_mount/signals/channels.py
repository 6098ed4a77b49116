"""Signals in SI as the topics of a recording, message by message in the order of their stamps.

Those that drive something are written at its rate, others as sampled.
"""

from bisect import bisect_left
from collections.abc import Callable, Mapping, Sequence
from operator import itemgetter
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from engine_mount.recordings.metadata import units_text
from engine_mount.signals.even_grid import evenly_spaced
from engine_mount.signals.excitation import LONGEST_GAP
from engine_mount.signals.excitation import LOWEST_RATE as LOWEST_RATE_OF_ACCELERATION
from engine_mount.signals.quantities import QUANTITIES, Quantity
from engine_mount.signals.resampling import has_step, resampled
from engine_mount.signals.signal import SECOND, FloatArray, Signal, SignalError, check_order, check_size
from mount_control.settings import ControlParameters
from mount_models.sampling import SAMPLE_RATE, sample_time_ns
from mount_recorder.bag_writer import BagWriter
from mount_recorder.mcap_writer import LONG_CHUNK_SIZE
from mount_recorder.session import session_text
from mount_ros import topics
from mount_ros.messages.cdr import accelerometer, string_message
from mount_ros.messages.scalars import OneNumberLayout, ScalarsLayout
from mount_ros.topics import JOINT_STATE, SESSION, Delivery, Scalar, Topic

DISPLACEMENT, ENGINE, CHASSIS = 'displacement', 'engine_displacement', 'chassis_displacement'
ACCELERATION = 'acceleration'
LOWEST_RATE = 100.0  # Hz, chosen: five times the 20 Hz up to which an engine moves on its mounts
SHORTEST = 0.5  # s, chosen: four periods of the band
PREFIX = 'measured/'
"""The beginning of topics that only foreign recordings have."""
SCENARIO = 'imported'
"""The scenario of such a recording, as its session tells it."""
_BLOCK = 5_000_000_000  # ns, chosen: 5 s at 1 kHz are 2 MB of messages for each topic


class Channel(NamedTuple):
    """What is written in a `field` of a topic: values (n,) in the SI unit `unit`.

    Their `times` (n,), rising, are in s after `begin` (ns).
    """

    topic: Topic
    field: str
    unit: str
    times: FloatArray
    begin: int
    values: FloatArray

    def stamps(self, place: Any) -> Any:
        """Return the stamps in ns at `place`, an index or a slice."""
        return self.begin + np.rint(SECOND * self.times[place]).astype(np.int64)


def recorded_as(wanted: Quantity) -> tuple[Topic, str]:
    """Return topic and field of a quantity: displacement and acceleration where every command takes them."""
    if wanted.name == DISPLACEMENT:
        return topics.DISPLACEMENT, topics.DISPLACEMENT.names[0]
    if wanted.name == ACCELERATION:
        return topics.SIM_CHASSIS_ACCELERATION, 'linear_acceleration.z'
    scalar = Scalar(wanted.name, wanted.unit.symbol)
    topic = Topic(PREFIX + wanted.name, JOINT_STATE, Delivery.STREAM, 0.0, wanted.sentence, (scalar,))
    return topic, wanted.name


def channels_of(
    signals: Mapping[str, Signal], quantities: Mapping[str, Quantity]
) -> tuple[list[Channel], list[str]]:
    """Return what is recorded of `signals` (SI, without long gaps), and sentences on what was done.

    Raises `SignalError` for what no command could follow.
    """
    notes: list[str] = []
    found: dict[str, tuple[FloatArray, int, FloatArray]] = {}
    ends = (DISPLACEMENT,) if DISPLACEMENT in signals else (ENGINE, CHASSIS)
    if all(name in signals for name in ends):
        sides = [signals[name] for name in ends]
        times, begin, (upper, *lower) = _resampled(sides, LOWEST_RATE, SHORTEST, notes)
        found[DISPLACEMENT] = times, begin, upper - sum(lower)
        check_size(
            ' and '.join(one.name for one in sides), found[DISPLACEMENT][-1], 1.0 / SAMPLE_RATE,
            ControlParameters().displacement_range, 'm',
            'is its unit another one, its zero another offset (in a mapping file), or is this sample a fault '
            'to cut out?',
        )  # fmt: skip
    for name, signal in signals.items():
        if name == ACCELERATION:
            times, begin, (values,) = _resampled([signal], LOWEST_RATE_OF_ACCELERATION, 0.0, notes)
            found[name] = times, begin, values
        elif name != DISPLACEMENT:
            check_order(signal.name, signal.times, 'cut the file there')
            found[name] = signal.times, signal.begin, signal.values
    channels = []
    for name, sampled in found.items():
        wanted = quantities.get(name) or QUANTITIES[name]
        channels.append(Channel(*recorded_as(wanted), wanted.unit.symbol, *sampled))
    return channels, list(dict.fromkeys(notes))


def write_channels(
    folder: Path, channels: Sequence[Channel], session: dict[str, Any], progress: Callable[[float], None]
) -> None:
    """Write the recording `folder`; log times are the stamps. `progress` takes the share that is done."""
    writer = BagWriter(folder, chunk_size=LONG_CHUNK_SIZE)
    begin = min(int(channel.stamps(0)) for channel in channels)
    end = max(int(channel.stamps(-1)) for channel in channels)
    try:
        writer.add_topic(f'/{SESSION.name}', SESSION.type)
        for channel in channels:
            topic = channel.topic
            # of topics that every command takes the registry tells the unit
            units = {channel.field: channel.unit} if topic.name.startswith(PREFIX) else {}
            writer.add_topic(f'/{topic.name}', topic.type, details=units_text(units))
        writer.write(f'/{SESSION.name}', string_message(session_text(session)), begin)
        for first in range(begin, end + 1, _BLOCK):
            _write_block(writer, channels, first, first + _BLOCK)
            progress(min(1.0, (first + _BLOCK - begin) / (end + 1 - begin)))
    finally:
        writer.close()


def _resampled(
    signals: Sequence[Signal], lowest_rate: float, shortest: float, notes: list[str]
) -> tuple[FloatArray, int, list[FloatArray]]:
    """Return times (s) at the rate of a drive for as long as all signals last, their begin (ns), and values.

    Adds what was done to `notes`; raises `SignalError`, also where they last for less than `shortest` (s).
    """
    even = [evenly_spaced(signal, LONGEST_GAP, lowest_rate) for signal in signals]
    notes += [note for one in even for note in one.notes]
    step, step_ns = 1.0 / SAMPLE_RATE, sample_time_ns(SAMPLE_RATE)
    ends = [one.begin + round(one.length * SECOND) for one in even]
    begin = max(one.begin for one in even)
    count = round((min(ends) - begin) / step_ns) + 1
    if count * step < shortest:
        spans = '; '.join(
            f'{one.name}: {one.begin / SECOND:.3f} .. {end / SECOND:.3f} s'
            for one, end in zip(even, ends, strict=True)
        )
        raise SignalError(f'no overlap of {shortest:g} s or more: {spans}')
    notes += [
        f'{one.name}: resampled from {one.rate:.4g} Hz to {SAMPLE_RATE / 1000.0:g} kHz, band-limited'
        for one in even
        if not has_step(one, step)
    ]
    values = [resampled(one, step, (begin - one.begin) / SECOND, count)[:] for one in even]
    return np.arange(count, dtype=np.float64) * step, begin, values


def _write_block(writer: BagWriter, channels: Sequence[Channel], first: int, behind: int) -> None:
    """Write the messages from `first` on and before `behind` (ns)."""
    messages: list[tuple[int, str, bytes]] = []
    for channel in channels:
        places = range(channel.values.size)
        part = slice(*(bisect_left(places, edge, key=channel.stamps) for edge in (first, behind)))
        if part.start < part.stop:
            topic, own, values = channel.topic, channel.stamps(part), channel.values[part]
            if topic.type == JOINT_STATE:
                rows = ScalarsLayout(topic).pack_rows(own, values[:, None])
            else:
                rows = OneNumberLayout(accelerometer).pack_rows(own, values)
            raw = rows.view(f'V{rows.shape[1]}').ravel().tolist()
            messages += zip(own.tolist(), [f'/{topic.name}'] * len(raw), raw, strict=True)
    for stamp, name, message in sorted(messages, key=itemgetter(0)):
        writer.write(name, message, stamp)
