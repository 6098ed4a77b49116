"""A simulated drive without middleware; its recording holds the same data topics as that of the graph."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from engine_mount.drives.loop import compiled_loop as loop
from engine_mount.drives.loop.chain import CoreChain
from engine_mount.drives.loop.messages import CoreMessages, Samples, Write, WriteColumns
from engine_mount.settings.chosen import Parameters
from engine_mount.signals.excitation import build_excitation
from mount_bringup.settings import check_sample_rate
from mount_driver.quantisation import quantised_coil_temperature, quantised_setpoint_current
from mount_init.initialisation import OFF, InitialisationResult
from mount_models.quantity import with_flattened
from mount_sim.electronics.electronics import Reading, status_every
from mount_sim.electronics.faults.schedule import check_without_bus
from mount_sim.excitation.excitation import Excitation
from mount_sim.parameters import SimParameters
from mount_sim.plant.places import ALONE
from mount_sim.plant.simulated_car import BeyondRange, SimulatedCar, SimulatedMount

BLOCK = 1000
"""Samples, chosen: packed and written together."""


@dataclass(frozen=True)
class CoreOutcome:
    """What a core run did; times in s."""

    samples: int
    excitation_start: float
    simulated: float
    wall_time: float
    result: InitialisationResult | None
    beyond_range: BeyondRange
    control_faults: int = 0  # times that the controller found its memory spoiled


class Sink(Protocol):
    """What takes the samples of a run; `write_samples` empties the block that it is given."""

    def write_samples(self, samples: Samples) -> None: ...

    def write_result(self, stamp: int, result: InitialisationResult) -> None: ...

    def write_off(self, stamp: int) -> None: ...


def run_core(
    parameters: Parameters,
    write: Write,
    progress: Callable[[float], None] = lambda share: None,
    write_columns: WriteColumns | None = None,
    excitation: Excitation | None = None,
) -> CoreOutcome:
    """Run the scenario in `parameters` to its end and hand every message to `write`.

    With `write_columns` those of the samples go there, many at a time. `excitation` is that of the scenario
    where it is built already.
    """
    sim = _sim_parameters(parameters)
    messages = CoreMessages(write, coil_temperature(sim), write_columns, sim.sample_rate)
    return run_core_into(messages, parameters, progress, excitation)


def run_core_into(
    messages: Sink,
    parameters: Parameters,
    progress: Callable[[float], None] = lambda share: None,
    excitation: Excitation | None = None,
) -> CoreOutcome:
    """Run the scenario in `parameters` to its end and hand samples and result to `messages`."""
    check_sample_rate(parameters)
    sim = _sim_parameters(parameters)
    check_without_bus(sim.faults)
    car = SimulatedCar(parameters.get('mount_sim', {}), excitation or build_excitation(sim))
    mount = car.mounts[ALONE]
    chain = CoreChain(parameters)
    celsius, with_status = coil_temperature(sim), status_every(sim.sample_rate)
    samples = Samples(BLOCK, chain.policy)
    pending: float | None = None
    begin = time.monotonic()
    while not mount.finished:
        if not samples.room:
            messages.write_samples(samples)
            progress(mount.sample / mount.run.samples)
        if pending is not None and mount.faults.none_told and chain.loop.expects(stamp_of(mount)):
            taken, pending = _take_many(mount, chain, samples, pending)
            if taken:
                continue
        if mount.sample % with_status == 0:
            chain.take_temperature(stamp_of(mount), celsius)
        pending = take_one(mount, chain, samples, pending)
        if chain.result is not None and not chain.controlled:
            messages.write_samples(samples)
            messages.write_result(stamp_of(mount) - mount.sample_time, chain.result)
    setpoint = samples.setpoints[samples.count - 1]
    messages.write_samples(samples)
    if chain.controlled and setpoint != OFF:
        messages.write_off(stamp_of(mount) - mount.sample_time)  # as mount_control when it is deactivated
    return CoreOutcome(
        samples=mount.sample,
        excitation_start=mount.run.excitation_start * (1.0 / sim.sample_rate),
        simulated=mount.time,
        wall_time=time.monotonic() - begin,
        result=chain.result,
        beyond_range=mount.beyond_range,
        control_faults=chain.loop.faults,
    )


def _sim_parameters(parameters: Parameters) -> SimParameters:
    return with_flattened(SimParameters(), parameters.get('mount_sim', {}))


def coil_temperature(sim: SimParameters) -> float:
    """Return the coil temperature (degC) as the electronics' status tells it."""
    return quantised_coil_temperature(sim.electronics.coil_temperature)


def stamp_of(mount: SimulatedMount) -> int:
    """Return the stamp (ns) of the next sample."""
    return mount.sample * mount.sample_time


def take_one(mount: SimulatedMount, chain: CoreChain, samples: Samples, pending: float | None) -> float:
    """Take one sample and return the setpoint (A) as it arrives for the next."""
    place, stamp = samples.count, stamp_of(mount)
    reading = Reading(*loop.over_the_bus(*mount.measure()))
    setpoint = chain.answer(stamp, reading)
    trace = chain.loop.trace
    samples.stamps[place] = stamp
    samples.readings[place] = reading
    samples.setpoints[place] = setpoint
    samples.truths[place] = np.frombuffer(mount.truth_bytes, np.uint8)
    samples.traced[place] = trace is not None
    if trace is not None:
        samples.traces[place] = trace
    samples.count += 1
    mount.advance(pending)
    return quantised_setpoint_current(setpoint)


def _take_many(
    mount: SimulatedMount, chain: CoreChain, samples: Samples, pending: float
) -> tuple[int, float]:
    """Take samples while all of them are plausible; return how many, and the setpoint (A) for the next."""
    controller = chain.loop.controller
    assert controller is not None
    plausibility, ahead = chain.loop.plausibility, mount.ahead(samples.room)
    part = slice(samples.count, samples.count + len(ahead.values))
    taken, arrived, last = loop.run_with(chain.policy)(
        ahead,
        controller.memory,
        (plausibility.limits, plausibility.memory),
        chain.displacement_range,
        pending,
        samples.readings[part],
        samples.setpoints[part],
        samples.truths[part],
        samples.traces[part],
    )
    if taken:
        stamps = stamp_of(mount) + mount.sample_time * np.arange(taken)
        part = slice(samples.count, samples.count + taken)
        samples.stamps[part] = stamps
        samples.traced[part] = True
        samples.count += taken
        chain.loop.follow(int(stamps[-1]), taken)
        mount.skip(taken, last)
    return taken, arrived
