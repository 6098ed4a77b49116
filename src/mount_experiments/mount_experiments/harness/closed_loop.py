"""Controller and plant together, once through: driven, recorded, and read back."""

import io
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from mount_bags.bag.recording import open_recording
from mount_bags.run.screen import Screen
from mount_bringup.graph.domain import chosen_domain
from mount_bringup.mount_choice import with_control_of_mount
from mount_bringup.settings import defaults_of_nodes
from mount_experiments.harness.contract import ExperimentError, Order
from mount_replay.drive.drive import DriveOrder, record_drive
from mount_report.drive.evaluation import Drive, load_drive

FloatArray = npt.NDArray[np.float64]

_COLUMNS = {
    'sim/truth': (
        *('displacement', 'velocity', 'mount_force', 'friction_force'),
        *('chassis_acceleration', 'coil_current'),
    ),
    'control_trace': ('band_displacement',),
}


@dataclass(frozen=True)
class Ride:
    """One run as it stands in its recording, from the start of the excitation on; SI, arrays (n,) at 1 kHz.

    What the rack and the chassis measure is taken from `sim/truth`; `seen` is what sensor and control saw,
    `band_displacement` what the control compares with its levels, at `band_time`.
    """

    recording: Path
    time: FloatArray
    displacement: FloatArray
    velocity: FloatArray
    mount_force: FloatArray
    friction_force: FloatArray
    chassis_acceleration: FloatArray
    coil_current: FloatArray
    seen: Drive
    band_time: FloatArray
    band_displacement: FloatArray


def mode_of(order: Order) -> str:
    """Return how an order's runs are driven."""
    return 'lock-step' if order.graph else 'core'


def settings_of_run(
    order: Order, own: Mapping[str, Mapping[str, Any]], experiment: str
) -> dict[str, dict[str, Any]]:
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


def ride(order: Order, label: str, own: Mapping[str, Mapping[str, Any]], experiment: str) -> Ride:
    """Run a scenario in `order.out / label`, by plain calls or through the real nodes, and read it back.

    `own` holds the parameters that the experiment sets, `mount_sim.scenario` among them.
    """
    parameters = settings_of_run(order, own, experiment)
    drive_order = DriveOrder(
        scenario=str(own['mount_sim']['scenario']),
        mode=mode_of(order),
        parameters=parameters,
        domain=chosen_domain(None) if order.graph else 0,
        out=order.out / label,
    )
    # the experiments' own bar is on the screen
    folder, run, complaints = record_drive(drive_order, Screen(io.StringIO()))
    recording = open_recording(folder.recording)
    complaints += recording.warnings
    if complaints:
        raise ExperimentError(
            f'run {label} in {folder.path} was not as it should be: {"; ".join(complaints)}'
        )
    return _read(recording, folder.recording, float(run['excitation_start']))


def _read(recording: Any, place: Path, excitation_start: float) -> Ride:
    seen = load_drive(recording, excitation_start, _COLUMNS)
    truth, trace = recording['sim/truth'], recording['control_trace']
    order = np.argsort(truth.stamps)
    order = order[truth.stamps[order] >= seen.zero]

    def column(name: str) -> FloatArray:
        return np.asarray(truth[name][order], np.float64)

    return Ride(
        recording=place,
        time=(truth.stamps[order] - seen.zero) * 1e-9,
        displacement=column('displacement'),
        velocity=column('velocity'),
        mount_force=column('mount_force'),
        friction_force=column('friction_force'),
        chassis_acceleration=column('chassis_acceleration'),
        coil_current=column('coil_current'),
        seen=seen,
        band_time=(trace.stamps - seen.zero) * 1e-9,
        band_displacement=np.asarray(trace['band_displacement'], np.float64),
    )
