"""A simulated drive without middleware: the laws of simulator, initialisation and control as function calls.

Its recording holds the same data topics as that of the graph, to the bit those in lock-step.
"""

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from engine_mount.drives.loop import compiled_loop as loop
from engine_mount.drives.loop.messages import (
    CoreMessages,
    Samples,
    Write,
    WriteColumns,
    coil_temperature,
    sent_speed,
)
from engine_mount.settings.chosen import Parameters, chosen_control, chosen_initialisation
from engine_mount.settings.options import settings_of_mounts
from engine_mount.signals.excitation import build_excitation
from mount_bringup.settings import check_sample_rate
from mount_control.control_loop import OFF, ControlLoop
from mount_init.estimate import TemperatureReadings
from mount_init.initialisation import InitialisationResult
from mount_sim.electronics.electronics import Reading, status_every
from mount_sim.electronics.faults import check_without_bus
from mount_sim.electronics.vehicle_bus import sent_every
from mount_sim.excitation.excitation import Excitation
from mount_sim.plant.mounts import ALONE
from mount_sim.plant.simulated_car import BeyondRange, SimulatedCar, SimulatedMount, mount_parameters
from mount_sim.quantisation import quantised_setpoint_current

BLOCK = 1000
"""Samples, chosen: packed and written together."""


@dataclass(frozen=True)
class CoreOutcome:
    """What a core run did; times in s. `result` is that of the (first) mount's initialisation.

    `control_faults` are the times that a controller found its memory spoiled.
    """

    samples: int
    excitation_start: float
    simulated: float
    wall_time: float
    result: InitialisationResult | None
    beyond_range: BeyondRange
    control_faults: int = 0


class Sink(Protocol):
    """Takes the samples of a run; `write_samples` empties the block that it is given."""

    def write_samples(self, samples: Samples) -> None: ...

    def write_result(self, stamp: int, result: InitialisationResult) -> None: ...

    def write_off(self, stamp: int) -> None: ...


class CoreChain:
    """Initialisation and control of one mount: the first answers until its ramp is over, then the second."""

    def __init__(self, parameters: Parameters):
        self.temperatures = TemperatureReadings()
        self._initialisation = chosen_initialisation(parameters, self.temperatures)
        self.control = chosen_control(parameters)
        self.loop = ControlLoop()
        self.result: InitialisationResult | None = None
        self.controlled = False  # whether the controller answered the last sample, if only with 0 A

    def answer(self, stamp: int, reading: Reading) -> float:
        """Return the setpoint (A) for a sample of time `stamp` (ns) as it came over the bus."""
        self.controlled = self.loop.controller is not None
        current = self.loop.step(stamp, reading.displacement)
        if self.controlled:
            return OFF if current is None else current
        setpoint = self._initialisation.step(
            stamp, reading.coil_current, reading.current_rate, reading.flux_rate
        )
        if self._initialisation.finished:
            self.result = self._initialisation.result()
            table = self.control.table(*self.result.table, self.result.offset_current)
            self.loop.begin(self.control, table, stamp)
        return setpoint


class MountRun:
    """One simulated mount with the chain that answers it; samples and result go to `sink`."""

    def __init__(
        self, mount: SimulatedMount, chain: CoreChain, coil_celsius: float, sink: Sink, speed: float | None
    ):
        """`speed` (rad/s) of the engine as it arrives, None where the vehicle does not send it."""
        self.mount, self.chain, self._speed = mount, chain, speed
        self._speed_period = sent_every(mount.sample_rate) * mount.sample_time  # ns
        self._celsius, self._sink = coil_celsius, sink
        self._with_status = status_every(mount.sample_rate)
        self.samples = Samples(BLOCK, chain.control.policy)
        self._pending: float | None = None  # setpoint (A) that arrives for the next sample

    @property
    def stamp(self) -> int:
        """The stamp (ns) of the next sample."""
        return self.mount.sample * self.mount.sample_time

    def take(self) -> None:
        """Take the next sample."""
        mount, chain, samples = self.mount, self.chain, self.samples
        if not samples.room:
            self._sink.write_samples(samples)
        stamp, place = self.stamp, samples.count
        if mount.sample % self._with_status == 0:
            chain.temperatures.take(stamp, self._celsius)
        reading = Reading(*loop.over_the_bus(*mount.measure()))
        setpoint = chain.answer(stamp, reading)
        self._take_speed(stamp)
        trace = chain.loop.trace
        samples.stamps[place] = stamp
        samples.readings[place] = reading
        samples.setpoints[place] = setpoint
        samples.truths[place] = np.frombuffer(mount.truth_bytes, np.uint8)
        samples.traced[place] = trace is not None
        if trace is not None:
            samples.traces[place] = trace
        samples.count += 1
        mount.advance(self._pending)
        self._pending = quantised_setpoint_current(setpoint)
        if chain.result is not None and not chain.controlled:
            self._sink.write_samples(samples)
            self._sink.write_result(stamp, chain.result)

    def take_many(self) -> int:
        """Take samples of a mount alone up to the first that needs more than a step of the controller.

        Return how many, at most as many as there is room for.
        """
        mount, chain, samples = self.mount, self.chain, self.samples
        if not samples.room:
            self._sink.write_samples(samples)
        if self._pending is None or not (mount.faults.none_told and chain.loop.expects(self.stamp)):
            return 0
        controller, plausibility = chain.loop.controller, chain.loop.plausibility
        assert controller is not None
        ahead = mount.ahead(samples.room)
        part = slice(samples.count, samples.count + len(ahead.values))
        taken, self._pending, last = loop.run_with(chain.control.policy)(
            ahead,
            controller.memory,
            (plausibility.limits, plausibility.memory),
            chain.control.parameters.displacement_range,
            np.full(len(ahead.values), chain.loop.engine_speed.at(self.stamp)),  # it idles at one speed
            self._pending,
            samples.readings[part],
            samples.setpoints[part],
            samples.truths[part],
            samples.traces[part],
        )
        if taken:
            part = slice(samples.count, samples.count + taken)
            samples.stamps[part] = self.stamp + mount.sample_time * np.arange(taken)
            samples.traced[part] = True
            samples.count += taken
            chain.loop.follow(int(samples.stamps[samples.count - 1]), taken)
            self._take_speed(self.stamp, taken)
            mount.skip(taken, last)
        return taken

    def _take_speed(self, first: int, count: int = 1) -> None:
        """Let the control take what the vehicle sends with `count` samples from the stamp `first` (ns) on."""
        if self._speed is not None:
            end, period = first + count * self.mount.sample_time, self._speed_period
            for stamp in range(first + -first % period, end, period):
                self.chain.loop.engine_speed.take(stamp, self._speed, stamp)

    def end(self) -> None:
        """Write the remaining samples, and 0 A as mount_control answers when it is deactivated."""
        last = self.samples.setpoints[self.samples.count - 1]
        self._sink.write_samples(self.samples)
        if self.chain.controlled and last != OFF:
            self._sink.write_off(self.stamp - self.mount.sample_time)


def run_core(
    parameters: Parameters,
    write: Write,
    progress: Callable[[float], None] = lambda share: None,
    write_columns: WriteColumns | None = None,
    excitation: Excitation | None = None,
) -> CoreOutcome:
    """Run the scenario of one mount to its end and hand every message to `write`.

    With `write_columns` those of the samples go there, many at a time. `excitation` is that of the scenario
    where it is built already.
    """
    messages = CoreMessages(parameters.get('mount_sim', {}), write, write_columns)
    return run_core_into(messages, parameters, progress, excitation)


def run_core_into(
    sinks: Sink | Mapping[str, Sink],
    parameters: Parameters,
    progress: Callable[[float], None] = lambda share: None,
    excitation: Excitation | None = None,
) -> CoreOutcome:
    """Run the scenario to its end and hand samples and results to the sink, or to that of each mount.

    `progress` takes the share that is done.
    """
    values = parameters.get('mount_sim', {})
    settings = settings_of_mounts(parameters)
    for name, own in settings.items():
        check_sample_rate(own)
        check_without_bus(mount_parameters(values, name).faults)
    car = SimulatedCar(values, excitation or build_excitation(mount_parameters(values)))
    speed = sent_speed(values)
    of_mounts = sinks if isinstance(sinks, Mapping) else {ALONE: sinks}
    runs = [
        MountRun(car.mounts[name], CoreChain(own), coil_temperature(values, name), of_mounts[name], speed)
        for name, own in settings.items()
    ]
    alone, last = len(runs) == 1, runs[-1].mount
    begin = time.monotonic()
    while not last.finished:
        if not runs[-1].samples.room:
            progress(last.sample / last.run.samples)
        if not (alone and runs[0].take_many()):
            for run in runs:
                run.take()
    for run in runs:
        run.end()
    beyond = [run.mount.beyond_range for run in runs if run.mount.beyond_range.samples]
    return CoreOutcome(
        samples=last.sample,
        excitation_start=last.run.excitation_start * (1.0 / last.sample_rate),
        simulated=last.time,
        wall_time=time.monotonic() - begin,
        result=runs[0].chain.result,
        beyond_range=BeyondRange(
            sum(each.samples for each in beyond), min((each.first for each in beyond), default=math.nan)
        ),
        control_faults=sum(run.chain.loop.faults for run in runs),
    )
