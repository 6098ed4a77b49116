"""A simulated drive without middleware; its recording holds the same data topics as that of the graph."""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass

from geometry_msgs.msg import WrenchStamped

from mount_bringup.core_chain import CoreChain, Parameters
from mount_driver.quantisation import (
    quantised_coil_current,
    quantised_current_rate,
    quantised_displacement,
    quantised_flux_rate,
    quantised_setpoint_current,
)
from mount_init.initialisation import OFF, InitialisationResult
from mount_models.quantity import with_flattened
from mount_ros import topics
from mount_ros.cdr import serialised
from mount_ros.force_table_message import to_message
from mount_ros.scalars import OneNumberLayout, ScalarsLayout
from mount_ros.topics import Topic
from mount_sim.electronics import Reading
from mount_sim.node import level_imu
from mount_sim.parameters import SimParameters
from mount_sim.scenario import build_excitation
from mount_sim.simulated_mount import SAMPLE_TIME, SimulatedMount

Write = Callable[[Topic, bytes, int], None]
"""Takes (topic, serialised message, stamp ns)."""

_SAMPLE_NANOSECONDS = round(SAMPLE_TIME * 1e9)
_PROGRESS_EVERY = 1000  # samples


@dataclass(frozen=True)
class CoreOutcome:
    """What a core run did; times in s."""

    samples: int
    excitation_start: float
    simulated: float
    wall_time: float
    result: InitialisationResult | None


def run_core(
    parameters: Parameters, write: Write, progress: Callable[[float], None] = lambda share: None
) -> CoreOutcome:
    """Run the scenario in `parameters` to its end and hand every message to `write`."""
    sim = with_flattened(SimParameters(), parameters.get('mount_sim', {}))
    mount = SimulatedMount(sim.plant, build_excitation(sim), sim.seed)
    chain = CoreChain(parameters)
    messages = _Messages(write)
    pending: float | None = None
    begin = time.monotonic()
    while not mount.finished:
        stamp = mount.sample * _SAMPLE_NANOSECONDS
        reading = _over_the_bus(mount.measure())
        traced = chain.controlling
        setpoint = chain.answer(stamp, reading)
        messages.write_sample(stamp, reading, setpoint, mount)
        if traced and chain.controller is not None and math.isfinite(reading.displacement):
            messages.write_trace(stamp, chain.controller.trace_bytes)
        elif chain.controlling and chain.result is not None:
            messages.write_result(stamp, chain.result)
        mount.advance(pending)
        pending = quantised_setpoint_current(setpoint)
        if mount.sample % _PROGRESS_EVERY == 0:
            progress(mount.sample / mount.run.samples)
    if chain.controlling and setpoint != OFF:
        messages.write_off(stamp)  # as mount_control does when it is deactivated
    return CoreOutcome(
        samples=mount.sample,
        excitation_start=mount.run.excitation_start * SAMPLE_TIME,
        simulated=mount.time,
        wall_time=time.monotonic() - begin,
        result=chain.result,
    )


def _over_the_bus(reading: Reading) -> Reading:
    current_rate = quantised_current_rate(reading.current_rate)
    flux_rate = quantised_flux_rate(reading.flux_rate)
    if math.isnan(current_rate) or math.isnan(flux_rate):
        current_rate = flux_rate = math.nan  # the two slopes share one validity bit
    return Reading(
        quantised_displacement(reading.displacement),
        quantised_coil_current(reading.coil_current),
        current_rate,
        flux_rate,
    )


class _Messages:
    """Makes the messages that the nodes would publish."""

    def __init__(self, write: Write):
        self._write = write
        self._displacement = ScalarsLayout(topics.DISPLACEMENT)
        self._ripple = ScalarsLayout(topics.COIL_RIPPLE)
        self._setpoint = ScalarsLayout(topics.CURRENT_SETPOINT)
        self._air_gap = ScalarsLayout(topics.AIR_GAP)
        self._trace = ScalarsLayout(topics.CONTROL_TRACE)
        self._truth = ScalarsLayout(topics.SIM_TRUTH)
        self._acceleration = OneNumberLayout(level_imu(), 'linear_acceleration.z')
        self._force = OneNumberLayout(WrenchStamped(), 'wrench.force.z')

    def write_sample(self, stamp: int, reading: Reading, setpoint: float, mount: SimulatedMount) -> None:
        write, truth = self._write, mount.truth
        write(topics.DISPLACEMENT, self._displacement.pack(stamp, (reading.displacement,)), stamp)
        ripple = self._ripple.pack(
            stamp, (reading.coil_current, math.nan), (reading.current_rate, reading.flux_rate)
        )
        write(topics.COIL_RIPPLE, ripple, stamp)
        write(topics.CURRENT_SETPOINT, self._setpoint.pack(stamp, (setpoint,)), stamp)
        write(topics.SIM_TRUTH, self._truth.pack_record(stamp, mount.truth_bytes), stamp)
        acceleration = self._acceleration.pack(stamp, truth['chassis_acceleration'])
        write(topics.SIM_CHASSIS_ACCELERATION, acceleration, stamp)
        write(topics.SIM_MOUNT_FORCE, self._force.pack(stamp, truth['mount_force']), stamp)

    def write_off(self, stamp: int) -> None:
        self._write(topics.CURRENT_SETPOINT, self._setpoint.pack(stamp, (OFF,)), stamp)

    def write_trace(self, stamp: int, trace: bytes) -> None:
        self._write(topics.CONTROL_TRACE, self._trace.pack_record(stamp, trace), stamp)

    def write_result(self, stamp: int, result: InitialisationResult) -> None:
        numbers = [getattr(result, name) for name in self._air_gap.names]
        self._write(topics.AIR_GAP, self._air_gap.pack(stamp, numbers), stamp)
        table = serialised(to_message(stamp, result.table))
        self._write(topics.CURRENT_FORCE_TABLE, table, stamp)
