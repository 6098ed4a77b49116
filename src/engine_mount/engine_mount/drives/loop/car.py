"""A simulated drive of several mounts without middleware: a chain of function calls for each of them."""

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from engine_mount.drives.loop.chain import CoreChain
from engine_mount.drives.loop.messages import Samples
from engine_mount.drives.loop.run import BLOCK, CoreOutcome, Sink, coil_temperature, stamp_of, take_one
from engine_mount.settings.chosen import Parameters
from engine_mount.settings.mounts import settings_of_mounts
from engine_mount.signals.excitation import build_excitation
from mount_init.initialisation import OFF
from mount_sim.electronics.electronics import status_every
from mount_sim.excitation.excitation import Excitation
from mount_sim.plant.simulated_car import BeyondRange, SimulatedCar, SimulatedMount, mount_parameters


@dataclass
class _Line:
    """One mount with the chain that answers it, its samples, and the setpoint (A) on its way."""

    mount: SimulatedMount
    chain: CoreChain
    celsius: float
    samples: Samples
    sink: Sink
    pending: float | None = None

    def take(self) -> None:
        """Take the next sample."""
        mount, chain, stamp = self.mount, self.chain, stamp_of(self.mount)
        if mount.sample % status_every(mount.sample_rate) == 0:
            chain.take_temperature(stamp, self.celsius)
        self.pending = take_one(mount, chain, self.samples, self.pending)
        found = chain.result is not None and not chain.controlled
        if found or not self.samples.room:
            self.sink.write_samples(self.samples)
        if found and chain.result is not None:
            self.sink.write_result(stamp, chain.result)

    def end(self) -> None:
        """Write what is left, and the setpoint of a controller that is switched off."""
        last = self.samples.setpoints[self.samples.count - 1]
        self.sink.write_samples(self.samples)
        if self.chain.controlled and last != OFF:
            self.sink.write_off(stamp_of(self.mount) - self.mount.sample_time)


def run_car_into(
    sinks: Mapping[str, Sink],
    parameters: Parameters,
    progress: Callable[[float], None] = lambda share: None,
    excitation: Excitation | None = None,
) -> CoreOutcome:
    """Run the scenario of a car with several mounts and hand samples and results of each to its sink."""
    values = parameters.get('mount_sim', {})
    car = SimulatedCar(values, excitation or build_excitation(mount_parameters(values)))
    lines = []
    for name, settings in settings_of_mounts(parameters).items():
        chain, celsius = CoreChain(settings), coil_temperature(mount_parameters(values, name))
        lines.append(_Line(car.mounts[name], chain, celsius, Samples(BLOCK, chain.policy), sinks[name]))
    last = lines[-1].mount
    begin = time.monotonic()
    while not last.finished:
        for line in lines:
            line.take()
        if last.sample % BLOCK == 0:
            progress(last.sample / last.run.samples)
    for line in lines:
        line.end()
    beyond = [line.mount.beyond_range for line in lines if line.mount.beyond_range.samples]
    return CoreOutcome(
        samples=last.sample,
        excitation_start=last.run.excitation_start * (1.0 / last.sample_rate),
        simulated=last.time,
        wall_time=time.monotonic() - begin,
        result=lines[0].chain.result,
        beyond_range=BeyondRange(
            sum(each.samples for each in beyond), min((each.first for each in beyond), default=math.nan)
        ),
        control_faults=sum(line.chain.loop.faults for line in lines),
    )
