"""The messages of a run without middleware: those that the nodes would publish, packed many at a time."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mount_control.policy.contract import Policy, trace_dtype, trace_fields
from mount_init.initialisation import OFF, InitialisationResult
from mount_models.sampling import sample_time_ns
from mount_ros import topics
from mount_ros.messages.cdr import accelerometer, temperature, wrench
from mount_ros.messages.force_table import table_message
from mount_ros.messages.scalars import OneNumberLayout, Rows, ScalarsLayout
from mount_ros.topics import Topic
from mount_sim.electronics.electronics import status_every
from mount_sim.electronics.vehicle_bus import received_velocity, sent_every
from mount_sim.plant.plant import TRUTH
from mount_sim.plant.simulated_car import mount_parameters
from mount_sim.quantisation import quantised_coil_temperature

Write = Callable[[Topic, bytes, int], None]
"""Takes (topic, serialised message, stamp ns)."""
Columns = Sequence[tuple[Topic, Rows]]
"""For each topic one serialised message per sample, all of one length; in the order within a sample."""
WriteColumns = Callable[[Columns, NDArray[np.int64]], None]
"""Takes the messages of some samples and the samples' stamps (ns)."""


class Samples:
    """Answered samples in a row; what stands behind `count` is not valid."""

    def __init__(self, capacity: int, policy: Policy):
        self.count = 0
        self.trace_topic = topics.control_trace(trace_fields(policy))
        self.stamps = np.zeros(capacity, np.int64)  # ns
        self.readings = np.zeros((capacity, 4))  # as they arrive: m, A, A/s, T/s
        self.setpoints = np.zeros(capacity)  # A
        self.truths = np.zeros((capacity, TRUTH.itemsize), np.uint8)  # records `TRUTH`
        self.traces = np.zeros((capacity, trace_dtype(policy).itemsize), np.uint8)  # where `traced`
        self.traced = np.zeros(capacity, bool)

    @property
    def room(self) -> int:
        """How many more samples there is room for."""
        return len(self.stamps) - self.count


class CoreMessages:
    """Packs samples and results and hands them on in the order of the stamps."""

    def __init__(
        self,
        sim: Mapping[str, Any],
        write: Write,
        write_columns: WriteColumns | None = None,
        mount: str = '',
    ):
        """`sim`: parameters of mount_sim. Without `write_columns` every message goes to `write`."""
        rate = mount_parameters(sim, mount).sample_rate
        self._coil_celsius = coil_temperature(sim, mount)
        self._status_period = status_every(rate) * sample_time_ns(rate)
        self._speed = sent_speed(sim)
        self._speed_period = sent_every(rate) * sample_time_ns(rate)
        self._write = write
        self._write_columns = write_columns or self._one_by_one
        self._displacement = ScalarsLayout(topics.DISPLACEMENT)
        self._ripple = ScalarsLayout(topics.COIL_RIPPLE)
        self._temperature = OneNumberLayout(temperature)
        self._engine_speed = ScalarsLayout(topics.ENGINE_SPEED)
        self._setpoint = ScalarsLayout(topics.CURRENT_SETPOINT)
        self._air_gap = ScalarsLayout(topics.AIR_GAP)
        self._truth = ScalarsLayout(topics.SIM_TRUTH)
        self._acceleration = OneNumberLayout(accelerometer)
        self._force = OneNumberLayout(wrench)

    def write_samples(self, samples: Samples) -> None:
        """Write all samples and empty the block."""
        stamps = samples.stamps[: samples.count]
        for begin, end in _alike(samples.traced[: samples.count]):
            part = slice(begin, end)
            self._write_with_slow(self._columns(samples, part), stamps[part])
        samples.count = 0

    def write_off(self, stamp: int) -> None:
        """Write the setpoint of a controller that is switched off."""
        self._write(topics.CURRENT_SETPOINT, self._setpoint.pack(stamp, (OFF,)), stamp)

    def write_result(self, stamp: int, result: InitialisationResult) -> None:
        """Write what an initialisation found."""
        numbers = [getattr(result, name) for name in self._air_gap.names]
        self._write(topics.AIR_GAP, self._air_gap.pack(stamp, numbers), stamp)
        table = table_message(stamp, result.table)
        self._write(topics.CURRENT_FORCE_TABLE, table, stamp)

    def _write_with_slow(self, columns: Columns, stamps: NDArray[np.int64]) -> None:
        """Write the columns up to each sample with a status or a speed, then what these carry, and go on."""
        begin, status = 0, stamps % self._status_period == 0
        speed = (stamps % self._speed_period == 0) & (self._speed is not None)
        for end in (np.flatnonzero(status | speed) + 1).tolist():
            self._write_columns([(topic, rows[begin:end]) for topic, rows in columns], stamps[begin:end])
            stamp = int(stamps[end - 1])
            if status[end - 1]:
                message = self._temperature.pack(stamp, self._coil_celsius)
                self._write(topics.COIL_TEMPERATURE, message, stamp)
            if speed[end - 1]:
                message = self._engine_speed.pack(stamp, (math.nan,), (self._speed or 0.0,))
                self._write(topics.ENGINE_SPEED, message, stamp)
            begin = end
        if begin < len(stamps):
            self._write_columns([(topic, rows[begin:]) for topic, rows in columns], stamps[begin:])

    def _columns(self, samples: Samples, part: slice) -> Columns:
        stamps, readings = samples.stamps[part], samples.readings[part]
        truth = samples.truths[part].view(TRUTH)[:, 0]
        unknown = np.full(len(stamps), math.nan)
        ripple = self._ripple.pack_rows(stamps, np.stack([readings[:, 1], unknown], 1), readings[:, 2:])
        columns = [
            (topics.DISPLACEMENT, self._displacement.pack_rows(stamps, readings[:, :1])),
            (topics.COIL_RIPPLE, ripple),
            (topics.CURRENT_SETPOINT, self._setpoint.pack_rows(stamps, samples.setpoints[part, None])),
            (topics.SIM_TRUTH, self._truth.pack_rows(stamps, samples.truths[part].view(np.float64))),
            (
                topics.SIM_CHASSIS_ACCELERATION,
                self._acceleration.pack_rows(stamps, truth['chassis_acceleration']),
            ),
            (topics.SIM_MOUNT_FORCE, self._force.pack_rows(stamps, truth['mount_force'])),
        ]
        if samples.traced[part.start]:
            layout = ScalarsLayout(samples.trace_topic)
            traces = layout.pack_rows(stamps, samples.traces[part].view(np.float64))
            columns.append((topics.CONTROL_TRACE, traces))
        return columns

    def _one_by_one(self, columns: Columns, stamps: NDArray[np.int64]) -> None:
        for place, stamp in enumerate(stamps.tolist()):
            for topic, rows in columns:
                self._write(topic, rows[place].tobytes(), stamp)


def _alike(flags: NDArray[np.bool_]) -> Iterator[tuple[int, int]]:
    """Yield (begin, end) of the stretches of equal flags."""
    changes = (np.flatnonzero(np.diff(flags)) + 1).tolist()
    if len(flags):
        yield from zip([0, *changes], [*changes, len(flags)], strict=True)


def sent_speed(values: Mapping[str, Any]) -> float | None:
    """Return the speed (rad/s) of the engine as it arrives, None where it is not sent; `values` as below."""
    idle = mount_parameters(values).idle
    return received_velocity(idle.frequency) if idle.speed_sent else None


def coil_temperature(values: Mapping[str, Any], mount: str = '') -> float:
    """Return the coil temperature (degC) that the status frame reports; `values`: those of mount_sim."""
    return quantised_coil_temperature(mount_parameters(values, mount).electronics.coil_temperature)
