"""What a recording's session tells of its run: levels, coil, damper. A report draws and computes with it."""

from typing import Any

import numpy as np

from engine_mount.recordings.session import SessionError, session_content, session_parameters
from engine_mount.reports.drawing.style import COLOUR_OF
from engine_mount.reports.drive.evaluation import acts_after, levels_of, tracking_error, wanted_force
from engine_mount.reports.drive.signals import load_drive
from engine_mount.reports.drive.undamped import UndampedError, undamped_of
from engine_mount.reports.sections.charts import Levels
from engine_mount.reports.sections.subject import RunFacts, Tracking, WithoutDamping
from engine_mount.reports.signals import Signals
from engine_mount.settings.chosen import Parameters, control_parameters, policy_of, with_recorded_policy
from mount_control.policy import switched_viscous
from mount_control.policy.contract import Policy
from mount_models.quantity import with_flattened
from mount_ros.topics import CONTROL_TRACE, DISPLACEMENT, SIM_TRUTH
from mount_sim.mount_choice import seat_of
from mount_sim.plant.mounts import without_friction
from mount_sim.plant.ripple import RippleCoil

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
            undamped_remark='the recording has no session that tells the excitation',
        )
    try:
        levels = levels_of(*policy_of(parameters))
        control = control_parameters(parameters)
        coil = with_flattened(RippleCoil(), parameters.get('mount_sim', {}), 'coil')
        no_friction = without_friction(seat_of(parameters))
    except (ValueError, TypeError, AttributeError) as error:
        return RunFacts(
            levels_remark=f'the parameters of the session cannot be used: {error}',
            tracking_remark=f'the parameters of the session cannot be used: {error}',
            undamped_remark=f'the parameters of the session cannot be used: {error}',
        )
    undamped, undamped_remark = _undamped(signals, parameters)
    tracking, remark = (None, f'not applicable: {no_friction}')
    if not no_friction:
        tracking, remark = _tracking(signals, parameters)
    return RunFacts(
        levels=Levels(levels, control.highest_current),
        resistance=coil.resistance,
        resistance_remark=f'R = {coil.resistance:g} ohm, limit {control.highest_current:g} A',
        tracking=tracking,
        tracking_remark=remark,
        undamped=undamped,
        undamped_remark=undamped_remark,
        without_friction=no_friction,
        colour=_colour(seat_of(parameters)),
    )


def _parameters(session: str) -> Parameters | None:
    """Return the parameters by node, None where the session tells none."""
    try:
        found = session_parameters(session_content(session))
        return with_recorded_policy(found) if found else None
    except SessionError:
        return None


def _colour(mount: str) -> str:
    """Return the colour of a mount; recordings of the friction mount are told apart by their own, so none."""
    return '' if mount.startswith('friction') and mount != 'friction_off' else COLOUR_OF.get(mount, '')


def _undamped(signals: Signals, parameters: Parameters) -> tuple[WithoutDamping | None, str]:
    try:
        found = undamped_of(signals.recording, parameters)
    except UndampedError as reason:
        return None, str(reason)
    time = (found.stamps - signals.zero) / 1e9
    begin = (found.begin - signals.zero) / 1e9
    return WithoutDamping(time, found.displacement, found.chassis_acceleration, begin), ''


def _tracking(signals: Signals, parameters: Parameters) -> tuple[Tracking | None, str]:
    recording = signals.recording
    lacking = [topic.name for topic in _NEEDED if signals.signal(topic.name, topic.names[0]) is None]
    if lacking:
        return None, f'what was not recorded is needed: {", ".join(lacking)}'
    try:
        policy, own = policy_of(parameters)
        drive = load_drive(recording)
        wanted, _ = wanted_force(drive, policy, own)
        error = tracking_error(drive, policy, own)
    except (ValueError, KeyError) as reason:
        return None, f'it cannot be computed: {reason}'
    shift = (drive.zero - signals.zero) / 1e9
    # What the controller wants while damping is off is no force.
    active = np.interp(drive.truth.time, drive.seen.time, drive.seen.damping_active.astype(float)) > 0.5
    shown = np.where(active, wanted, 0.0)
    tracking = Tracking((drive.truth.time + shift), shown, drive.truth.friction_force, error)
    return tracking, _wanted_words(policy, own, drive.sample_time)


def _wanted_words(policy: Policy, own: Any, sample_time: float) -> str:
    if policy is not switched_viscous:
        later = f'{1e3 * acts_after(sample_time):g} ms later'
        return f'wanted is the force that the policy asked for, {later}, when it acts'
    return f'wanted is the force of damper {own.damper} at the true velocity in the band, without delay'
