"""What a recording's session tells of its run: levels, coil, damper. A report draws and computes with it."""

from typing import Any

import numpy as np
import yaml

from mount_bringup.chosen import Parameters, chosen_damper, control_parameters, switched_viscous_parameters
from mount_bringup.mount_choice import seat_of
from mount_control.policy.switched_viscous import DEFAULT_DAMPER
from mount_models.coil.ripple import RippleCoil
from mount_models.quantity import with_flattened
from mount_report.drive.evaluation import load_drive, tracking_error, wanted_force
from mount_report.sections.figures import Levels
from mount_report.sections.subject import RunFacts, Tracking
from mount_report.signals import Signals
from mount_ros.topics import CONTROL_TRACE, DISPLACEMENT, SIM_TRUTH
from mount_sim.plant.mounts import without_friction

_NEEDED = (DISPLACEMENT, CONTROL_TRACE, SIM_TRUTH)
_NO_SESSION = 'the recording has no session message that tells them'


def run_facts(signals: Signals) -> RunFacts:
    """Return what the session of a recording tells; what it leaves out has its default."""
    parameters = _parameters(signals.session)
    if parameters is None:
        coil = RippleCoil()
        return RunFacts(
            levels_remark=_NO_SESSION,
            resistance=coil.resistance,
            resistance_remark=f'no session tells the coil: default R = {coil.resistance:g} ohm assumed',
            tracking_remark='the recording has no session that tells which force was wanted',
        )
    try:
        levels, highest = (
            switched_viscous_parameters(parameters),
            control_parameters(parameters).highest_current,
        )
        coil = with_flattened(RippleCoil(), parameters.get('mount_sim', {}), 'coil')
        no_friction = without_friction(seat_of(parameters))
    except (ValueError, TypeError, AttributeError) as error:
        return RunFacts(
            levels_remark=f'the parameters of the session cannot be used: {error}',
            tracking_remark=f'the parameters of the session cannot be used: {error}',
        )
    tracking, remark = (None, f'not applicable: {no_friction}')
    if not no_friction:
        tracking, remark = _tracking(signals, parameters)
    return RunFacts(
        levels=Levels(levels.switch_on_level, levels.switch_off_level, highest),
        resistance=coil.resistance,
        resistance_remark=f'R = {coil.resistance:g} ohm, limit {highest:g} A',
        tracking=tracking,
        tracking_remark=remark,
        without_friction=no_friction,
    )


def _parameters(session: str) -> Parameters | None:
    """Return the parameters by node, None where the session tells none."""
    try:
        content: Any = yaml.safe_load(session)
    except yaml.YAMLError:
        return None
    found = content.get('parameters') if isinstance(content, dict) else None
    if not isinstance(found, dict):
        return None
    return {str(node): values for node, values in found.items() if isinstance(values, dict)}


def _tracking(signals: Signals, parameters: Parameters) -> tuple[Tracking | None, str]:
    recording = signals.recording
    lacking = [topic.name for topic in _NEEDED if signals.signal(topic.name, topic.names[0]) is None]
    if lacking:
        return None, f'what was not recorded is needed: {", ".join(lacking)}'
    try:
        control, damper = switched_viscous_parameters(parameters), chosen_damper(parameters)
        drive = load_drive(recording)
        wanted, _ = wanted_force(drive, control, damper)
        error = tracking_error(drive, control, damper)
    except (ValueError, KeyError) as reason:
        return None, f'it cannot be computed: {reason}'
    shift = (drive.zero - signals.zero) / 1e9
    # What the controller wants while damping is off is no force.
    active = np.interp(drive.true_time, drive.time, drive.damping_active.astype(float)) > 0.5
    shown = np.where(active, wanted, 0.0)
    tracking = Tracking(drive.true_time + shift, shown, drive.friction_force, error)
    chosen = parameters.get('mount_control', {}).get('damper', DEFAULT_DAMPER)
    return tracking, f'wanted is the force of damper {chosen} at the true velocity in the band, without delay'
