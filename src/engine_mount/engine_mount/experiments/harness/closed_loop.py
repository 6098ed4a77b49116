"""Controller and plant together, once through: driven, recorded, and read back."""

from dataclasses import replace

from engine_mount.drives.drive import drive
from engine_mount.experiments.harness.contract import ExperimentError, Order, Settings, Values
from engine_mount.recordings.recording import open_recording
from engine_mount.reports.drive.signals import DriveSignals, load_drive
from mount_bringup.settings import defaults_of_nodes
from mount_sim.mount_choice import with_control_of_mount

PAPER = 'switched_viscous'
"""The policy of the paper, with which its scenes are driven."""


def mode_of(order: Order) -> str:
    """Return how an order's runs are driven."""
    return 'lock-step' if order.graph else 'core'


def settings_of_run(order: Order, own: Settings, experiment: str) -> dict[str, Values]:
    """Return the nodes' parameters: the user's and the experiment's `own`; raises where both set the same."""
    merged = {node: dict(values) for node, values in order.settings.items() if node in defaults_of_nodes()}
    for node, values in own.items():
        for name, value in values.items():
            if name in merged.get(node, {}):
                raise ExperimentError(
                    f'{node}.{name} is set by the experiment {experiment} itself; '
                    f'choose among the parameters of {experiment}, or use engine-mount drive'
                )
            merged.setdefault(node, {})[name] = value
    return with_control_of_mount(merged)


def driven(order: Order, label: str, own: Settings, experiment: str) -> DriveSignals:
    """Run a scenario in `order.out / label`, by plain calls or through the real nodes, and read it back.

    Time and truth begin with the excitation; what rack and chassis measure is taken from the truth.
    `own` holds the parameters that the experiment sets, `mount_sim.scenario` among them.
    """
    parameters = settings_of_run(order, own, experiment)
    run = drive(core=not order.graph, lockstep=order.graph, parameters=parameters, out=order.out / label)
    recording = open_recording(run.recording)
    if complaints := [*run.complaints, *recording.warnings]:
        raise ExperimentError(
            f'run {label} in {run.folder.path} was not as it should be: {"; ".join(complaints)}'
        )
    signals = load_drive(recording, run.excitation_start)
    return replace(signals, recording=run.recording, truth=signals.truth.since(0.0))
