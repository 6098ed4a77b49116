"""Fig. 7: the sticking contact is pulled by a ramp and held; its relaxation gives the linear parameters."""

from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np

from engine_mount.experiments.harness.contract import (
    Experiment,
    Holds,
    Order,
    Outcome,
    Progress,
    Seed,
    Statement,
    Values,
    parameters_of,
)
from engine_mount.experiments.harness.drawing import BLUE, GREY, RED, finish, new_figure
from engine_mount.experiments.harness.rack_recording import (
    SUBSTEPS,
    DisplacementNoise,
    ForceNoise,
    record_friction_rack,
)
from engine_mount.experiments.registry import NAMES
from engine_mount.identification.friction.files import read_recording
from engine_mount.identification.friction.ramp_hold import (
    Relaxation,
    contact_of_response,
    fit_relaxation,
    printed_formulas,
)
from engine_mount.identification.friction.recording import FloatArray, FrictionRecording
from mount_models.friction.coefficient import FrictionCoefficients, dynamic_coefficient
from mount_models.friction.contact import FrictionContact
from mount_models.quantity import Quantity, flattened
from mount_sim.rack.friction import move, with_noise

NAME = 'ramp_and_hold'
_NAMES = {'contact_stiffness': 'c_Re', 'tangential_stiffness': 'c_R', 'tangential_damping': 'd_R'}


class RampParameters(NamedTuple):
    """The ramp, the motor, the load cell and the pads on the rack."""

    way: Annotated[float, Quantity('m', 'wanted displacement after the ramp', 1e-6, 1e-4)] = 20e-6
    rest_time: Annotated[float, Quantity('s', 'time before the ramp', 0.05, 10.0)] = 0.1
    ramp_time: Annotated[float, Quantity('s', 'length of the ramp', 0.01, 10.0)] = 0.2
    hold_time: Annotated[float, Quantity('s', 'time of relaxation after it', 1.0, 60.0)] = 5.0
    fit_from: Annotated[
        float,
        Quantity('s', 'time after the start of the ramp from which Eq (10) is fitted', 0.0, 10.0, 'Fig. 7'),
    ] = 1.0
    motor_stiffness: Annotated[
        float, Quantity('N/m', "p: stiffness of the linear motor's position control", 1e4, 1e9)
    ] = 2e6
    normal_force: Annotated[
        float, Quantity('N', 'constant; high enough that nothing slides', 10.0, 1000.0)
    ] = 250.0
    force_noise: ForceNoise = 0.1
    displacement_noise: DisplacementNoise = 20e-9
    seed: Seed = 1
    friction: FrictionCoefficients = FrictionCoefficients()
    contact: FrictionContact = FrictionContact()


def run(order: Order, progress: Progress) -> Outcome:
    """Pull the sticking pads, record it, and take the linear parameters from the recording."""
    parameters = parameters_of(order, NAME, RampParameters())
    progress(0.1, 'ramp and hold')
    recording = _record(order, parameters)
    rack = read_recording(recording)
    progress(0.7, 'evaluation')
    time = rack.time - parameters.rest_time
    relaxation = fit_relaxation(time, rack.displacement, parameters.fit_from)
    results = _figures(rack, time, relaxation, parameters)
    picture = _draw(rack, time, relaxation, results, parameters, order.out / 'ramp_and_hold.png')
    return Outcome(results, [picture], [recording], _statements(results, parameters))


def _record(order: Order, parameters: RampParameters) -> Path:
    corners = np.cumsum([0.0, parameters.rest_time, parameters.ramp_time, parameters.hold_time])
    rack = move(
        parameters.contact,
        parameters.friction,
        corners,
        [0.0, 0.0, parameters.way, parameters.way],
        parameters.normal_force,
        machine_stiffness=parameters.motor_stiffness,
        substeps=SUBSTEPS,
    )
    measured = with_noise(rack, parameters.force_noise, parameters.displacement_noise, parameters.seed)
    session = {'scenario': NAME, 'mode': 'rack', 'parameters': {NAME: flattened(parameters)}}
    return record_friction_rack(order.out / NAME, measured, session)


def _wanted(time: FloatArray, parameters: RampParameters) -> FloatArray:
    """Return the wanted displacement x_d (m); the motor's control knows it, so it is no measurement."""
    return parameters.way * np.clip(time / parameters.ramp_time, 0.0, 1.0)


def _figures(
    rack: FrictionRecording, time: FloatArray, relaxation: Relaxation, parameters: RampParameters
) -> Values:
    held = time > 0.0
    yielding = _wanted(time, parameters) - rack.displacement
    final_force = float(np.mean(rack.force[time > time[-1] - 1.0]))
    p = float(np.polyfit(yielding[held], rack.force[held], 1)[0])
    whole = fit_relaxation(time, rack.displacement, parameters.ramp_time)
    first_force = float(np.max(rack.force[held]))
    readings = {
        'parameters': _of_relaxation(relaxation, final_force, p, parameters.ramp_time),
        'parameters_without_ramp_correction': _of_relaxation(relaxation, final_force, p, 0.0),
        'parameters_fitted_from_end_of_ramp': _of_relaxation(whole, final_force, p, parameters.ramp_time),
        'parameters_as_printed': _as_printed(relaxation, final_force, first_force, p, parameters.way),
    }
    true = {name: float(getattr(parameters.contact, name)) for name in readings['parameters']}
    errors = {
        name.replace('parameters', 'errors'): {key: found[key] / true[key] - 1.0 for key in true}
        for name, found in readings.items()
    }
    damping = readings['parameters']['tangential_stiffness'] * relaxation.time_constant
    breakaway = parameters.normal_force * dynamic_coefficient(
        parameters.friction, 0.0, relaxation.asymptote, parameters.normal_force
    )
    off = np.abs(relaxation.at(time) - rack.displacement)
    late = time >= parameters.fit_from
    during = held & (time < parameters.ramp_time)
    return {
        'joint_stiffness_n_per_m': final_force / relaxation.asymptote,
        'motor_stiffness_n_per_m': p,
        'time_constant_s': relaxation.time_constant,
        **readings,
        'true_parameters': true,
        **errors,
        'damping_error_as_printed': damping / true['tangential_damping'] - 1.0,
        'highest_force_n': first_force,
        'final_force_n': final_force,
        'breakaway_force_n': float(breakaway),
        'fit_error_late_m': float(off[late].max()),
        'fit_error_during_ramp_m': float(off[during].max()),
        'fit_error_between_m': float(off[held & ~during & ~late].max()),
    }


def _of_relaxation(
    relaxation: Relaxation, final_force: float, motor_stiffness: float, ramp_time: float
) -> dict[str, float]:
    joint = final_force / relaxation.asymptote
    found = contact_of_response(joint, motor_stiffness, relaxation.kappa(ramp_time), relaxation.time_constant)
    return {name: getattr(found, name) for name in _NAMES}


def _as_printed(
    relaxation: Relaxation, final_force: float, first_force: float, motor_stiffness: float, way: float
) -> dict[str, float]:
    """Return c_Re, c_R, d_R as printed, c_xi being the force over the wanted displacement in all three.

    So read, with p in series, the first formula is right.
    """
    lag = relaxation.time_constant
    printed = printed_formulas(
        final_force / relaxation.asymptote, final_force / way, motor_stiffness, first_force / final_force, lag
    )
    c_r = printed.tangential_stiffness_with_p
    return dict(zip(_NAMES, (printed.contact_stiffness, c_r, c_r * lag), strict=True))


def _draw(
    rack: FrictionRecording,
    time: FloatArray,
    relaxation: Relaxation,
    results: Values,
    parameters: RampParameters,
    file: Path,
) -> Path:
    figure = new_figure('Ramp and hold in microslip: step one of the identification (Fig. 7)', 4.2)
    left, middle, right = figure.subplots(1, 3)
    x, force = 1e6 * rack.displacement, rack.force
    left.plot(x, force, color=BLUE, linewidth=0.8, label='recorded')
    reach = np.array([0.0, x[-1]])
    stiffness = results['joint_stiffness_n_per_m']
    label = f'c_xi = {1e-6 * stiffness:.2f} N/um'
    left.plot(reach, 1e-6 * stiffness * reach, color=RED, linestyle='--', linewidth=1.0, label=label)
    left.set_xlabel('displacement x (µm)')
    yielding = 1e6 * _wanted(time, parameters) - x
    middle.plot(yielding, force, color=BLUE, linewidth=0.8, label='recorded')
    p = results['motor_stiffness_n_per_m']
    reach = np.array([0.0, yielding.max()])
    middle.plot(
        reach, 1e-6 * p * reach, color=RED, linestyle='--', linewidth=1.0, label=f'p = {1e-6 * p:.2f} N/um'
    )
    middle.set_xlabel('wanted minus measured (µm)')
    right.plot(time, x, color=BLUE, linewidth=0.8, label='recorded')
    after = time > 0.0
    right.plot(
        time[after], 1e6 * relaxation.at(time[after]), color=RED, linestyle='--', linewidth=1.0,
        label=f'Eq (10), T = {relaxation.time_constant:.3f} s',
    )  # fmt: skip
    right.axvline(parameters.fit_from, color=GREY, linestyle=':', linewidth=1.0, label='fitted from here')
    right.set_xlabel('time from the start of the ramp (s)')
    right.set_ylabel('displacement x (µm)')
    for axes in (left, middle):
        axes.set_ylabel('friction force (N)')
    for axes in (left, middle, right):
        axes.legend(fontsize='small')
    return finish(figure, file)


def _statements(results: Values, parameters: RampParameters) -> list[Statement]:
    errors, raw, whole, printed = (
        results[f'errors{name}']
        for name in ('', '_without_ramp_correction', '_fitted_from_end_of_ramp', '_as_printed')
    )
    microslip = results['highest_force_n'] < results['breakaway_force_n']
    late, ramp = results['fit_error_late_m'], results['fit_error_during_ramp_m']
    worst, worst_whole = (max(abs(error) for error in found.values()) for found in (errors, whole))
    return [
        Statement(
            'Sec. 4',
            'The whole test stays in microslip: nothing slides.',
            f'The force peaks at {results["highest_force_n"]:.1f} N; at {parameters.normal_force:g} N '
            f'normal force the pads break away at {results["breakaway_force_n"]:.1f} N (positive direction).',
            Holds.YES if microslip else Holds.NO,
        ),
        Statement(
            'Fig. 7, Eq (10)',
            'An exponential meets the measured displacement well for times above 1 s; before, the ramp '
            'shows.',
            f'From {parameters.fit_from:g} s on it lies within {1e9 * late:.0f} nm of the recording, '
            f'during the ramp up to {1e6 * ramp:.1f} um off; right behind the ramp it fits again '
            f'({1e9 * results["fit_error_between_m"]:.0f} nm), because the contact is linear.',
            Holds.YES if late < 0.1 * ramp else Holds.NO,
        ),
        Statement(
            'Eq (11)',
            'c_Re, c_R and d_R follow from the joint stiffness, p, the asymptote and T.',
            f'In its right form, with the amplitude corrected for the ramp: {_told(errors)}. '
            f'Without that correction: {_told(raw)}. Fitted from the end of the ramp on, where the fading is '
            f'still large against the noise: {_told(whole)}.',
            Holds.YES if worst < 0.03 else Holds.PARTLY if worst_whole < 0.03 else Holds.NO,
        ),
        Statement(
            'Eq (11) as printed',
            'The same three formulas, taken literally.',
            'With k as first over last force and c_xi as force over the wanted displacement, which makes '
            f'the first formula right but for the ramp: {_told(printed)}. The second is right only with '
            'c_xi over the measured displacement, where the first is wrong; the third forgets p: with the '
            f'right c_R it gives d_R {100 * results["damping_error_as_printed"]:+.1f} %. No reading makes '
            'all three right.',
            Holds.NO if max(abs(error) for error in printed.values()) > 0.05 else Holds.YES,
        ),
    ]


def _told(errors: dict[str, float]) -> str:
    return ', '.join(f'{_NAMES[name]} {100 * error:+.1f} %' for name, error in errors.items())


EXPERIMENT = Experiment(
    NAME,
    *NAMES[NAME],
    (
        'The motor of the rack, a spring p in series with the pads, pulls them by a short ramp and holds. '
        'Nothing slides; the parallel pair of spring and damper relaxes. The joint stiffness comes from the '
        'last second, p from the force over what the motor gives way, T and the amplitude from an '
        'exponential fitted to the displacement. Normal force, p and ramp are chosen: the paper gives none '
        'of them.'
    ),
    RampParameters(),
    run,
)
