"""Controller and plant together: drives that are recorded and read back, many runs that are not."""

from collections.abc import Callable, Mapping
from dataclasses import fields, replace
from typing import Any, NamedTuple, TypeVar

import numpy as np

from engine_mount.drives.drive import drive
from engine_mount.drives.loop.messages import Samples
from engine_mount.drives.loop.run import run_core_into
from engine_mount.experiments.harness.experiment import PAPER, ExperimentError, Order, Settings, Values
from engine_mount.fleet.runner import run_tasks
from engine_mount.recordings.recording import open_recording
from engine_mount.reports.drive.signals import DriveSignals, FloatArray, Truth, load_drive
from engine_mount.signals.excitation import build_excitation
from mount_bringup.settings import defaults_of_nodes
from mount_control.policy import switched_viscous
from mount_init.initialisation import InitialisationResult
from mount_models.quantity import with_flattened
from mount_models.sampling import SAMPLE_TIME
from mount_sim.electronics.electronics import Noise
from mount_sim.excitation.excitation import Shaking, steps_of_sample
from mount_sim.parameters import SimParameters
from mount_sim.plant.mounts import ALWAYS_ON, with_control_of_mount
from mount_sim.plant.plant import TRUTH, PlantSimulation

K = TypeVar('K')


def settings_of_run(order: Order, sim: Values, control: Values) -> dict[str, Values]:
    """Return the nodes' parameters: the user's and the experiment's own; raises where both set one."""
    merged = {node: dict(values) for node, values in order.settings.items() if node in defaults_of_nodes()}
    for node, values in (('mount_sim', sim), ('mount_control', control)):
        doubly = merged.setdefault(node, {}).keys() & values.keys()
        for name in sorted(doubly):
            raise ExperimentError(
                f'{node}.{name} is set by the experiment {order.experiment} itself; '
                f'choose among the parameters of {order.experiment}, or use engine-mount drive'
            )
        merged[node] |= values
    return with_control_of_mount(merged)


def drive_cases(order: Order, cases: Mapping[str, Values]) -> dict[str, DriveSignals]:
    """Drive {name: parameters of the simulator} with the policy of the order, always on with the paper's.

    Each is recorded in a folder of its name and read back. The damper is `damper` of the case, else that of
    the order. Time and truth begin with the excitation; what rack and chassis measure is from the truth.
    """
    drives = {}
    for number, (name, case) in enumerate(cases.items()):
        order.progress(0.95 * number / len(cases), name)
        sim = {'damper': order.parameters.damper, **case}
        control = {'policy': PAPER, 'damper': sim.pop('damper')}
        if sim['mount'] != ALWAYS_ON and order.policy != PAPER:
            control = {'policy': order.policy}
        drives[name] = _drive(order, name, settings_of_run(order, sim, control))
    return drives


def paper_policy(order: Order) -> switched_viscous.Parameters:
    """Return the parameters of the paper's policy in the drives of an order."""
    return with_flattened(switched_viscous.Parameters(), order.settings.get('mount_control', {}))


def _drive(order: Order, name: str, parameters: dict[str, Values]) -> DriveSignals:
    out = order.out / name.replace('0 A', '0A').replace(', ', '_').replace(' ', '_')
    run = drive(core=True, parameters=parameters, out=out)
    recording = open_recording(run.recording)
    if complaints := [*run.complaints, *recording.warnings]:
        raise ExperimentError(f'run {name} in {out} was not as it should be: {"; ".join(complaints)}')
    signals = load_drive(recording, run.excitation_start)
    return replace(signals, recording=run.recording, truth=signals.truth.since(0.0))


class Case(NamedTuple):
    """One run that is not recorded: the parameters of all nodes, and what makes figures of the truth."""

    parameters: Settings
    figures: Callable[[Truth, SimParameters], Values]


def run_cases(order: Order, cases: Mapping[K, Case]) -> dict[K, Values]:
    """Return {key: figures} of all cases, run in `workers` processes of the order, 0 for one on each core."""
    found: dict[K, Values] = {}
    keys = list(cases)
    for done in run_tasks(run_case, list(cases.values()), workers=order.parameters.workers):
        if done.result is None:
            raise done.error or ChildProcessError(done.reason)
        found[keys[done.place]] = done.result
        order.progress(0.95 * len(found) / len(keys), f'{len(found)} of {len(keys)} runs')
    return found


def run_case(case: Case) -> Values:
    """Run one case through the same closed loop as every drive in core and return its figures."""
    sim = with_flattened(SimParameters(), case.parameters['mount_sim'])
    return case.figures(truth_of_run(case.parameters), sim)


def truth_of_run(parameters: Settings) -> Truth:
    """Return the truth of a run in core from the begin of the excitation on; nothing is recorded."""
    sink = _TruthSink()
    outcome = run_core_into(sink, parameters)
    records = np.concatenate(sink.blocks).view(TRUTH)[round(outcome.excitation_start / SAMPLE_TIME) :, 0]
    columns = {each.name: records[each.name].copy() for each in fields(Truth) if each.name != 'time'}
    return Truth(time=SAMPLE_TIME * np.arange(len(records)), **columns)


def at_each_step(setpoints: FloatArray, sim: SimParameters, *, straight: bool = False) -> Any:
    """Return the columns of `sim/truth` at each step of the plant, driven by `setpoints` (A, (n,)).

    These are the true ones at the samples of a run. With `straight` the current wanted goes to each of them
    in a straight line.
    """
    excitation = build_excitation(sim)
    plant = PlantSimulation(sim.plant, excitation.seat, excitation.step_time)
    shaking, quiet, before = Shaking(excitation, sim.sample_rate), np.zeros(Noise.NUMBERS), 0.0
    steps = steps_of_sample(sim.sample_rate, excitation.step_time)
    found = np.zeros((len(setpoints) - 1, steps), TRUTH)
    for sample, wanted in enumerate(setpoints[1:].tolist()):  # a sample knows the one that led to it
        values, forces = shaking.at(shaking.start + sample)
        for step in range(len(values)):
            plant.read(quiet)
            found[sample, step] = plant.truth
            share = (step + 1) / len(values) if straight else 1.0
            part = slice(step, step + 1)
            plant.advance(values[part], forces[part], before + share * (wanted - before))
        before = wanted
    return found.ravel()


class _TruthSink:
    """Keeps the truth of a run, nothing else."""

    def __init__(self) -> None:
        self.blocks: list[Any] = []

    def write_samples(self, samples: Samples) -> None:
        """Take the block's truths and empty it."""
        self.blocks.append(samples.truths[: samples.count].copy())
        samples.count = 0

    def write_result(self, stamp: int, result: InitialisationResult) -> None:
        """Let the initialisation's result pass: the controller has it."""

    def write_off(self, stamp: int) -> None:
        """Let the last setpoint pass."""
