"""Fig. 7: the sticking contact is pulled by a ramp and held; its relaxation gives the linear parameters."""

from typing import Annotated, Any, NamedTuple

import numpy as np

from engine_mount.experiments.harness.drawing import BLUE, GREY, RED, new_panels
from engine_mount.experiments.harness.experiment import (
    PARTLY,
    Experiment,
    Findings,
    Order,
    Seed,
    Values,
    claim,
)
from engine_mount.experiments.harness.rack_recording import (
    SUBSTEPS,
    DisplacementNoise,
    ForceNoise,
    record_friction_rack,
)
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
from mount_sim.rack import move, with_noise

NAME = 'ramp_and_hold'
_SYMBOLS = {'contact_stiffness': 'c_Re', 'tangential_stiffness': 'c_R', 'tangential_damping': 'd_R'}


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


def run(order: Order) -> Findings:
    """Pull the sticking pads, record it, and take the linear parameters from the recording."""
    own = order.parameters
    corners = np.cumsum([0.0, own.rest_time, own.ramp_time, own.hold_time])
    ways = [0.0, 0.0, own.way, own.way]
    pulled = move(
        own.contact,
        own.friction,
        corners,
        ways,
        own.normal_force,
        machine_stiffness=own.motor_stiffness,
        substeps=SUBSTEPS,
    )
    measured = with_noise(pulled, own.force_noise, own.displacement_noise, own.seed)
    session = {'scenario': NAME, 'mode': 'rack', 'parameters': {NAME: flattened(own)}}
    recording = record_friction_rack(order.out / NAME, measured, session)
    rack = read_recording(recording)
    time = rack.time - own.rest_time
    # the wanted displacement x_d (m), which the motor's control knows, less the measured one
    yielding = own.way * np.clip(time / own.ramp_time, 0.0, 1.0) - rack.displacement
    relaxation = fit_relaxation(time, rack.displacement, own.fit_from)
    figures = figures_of(rack, time, yielding, relaxation, own)
    picture = draw_relaxation(rack, time, yielding, relaxation, figures, own.fit_from)
    return Findings(figures, {NAME: picture}, [recording], judged={**own._asdict(), **figures})


def figures_of(
    rack: FrictionRecording,
    time: FloatArray,
    yielding: FloatArray,
    relaxation: Relaxation,
    own: RampParameters,
) -> Values:
    """Return stiffnesses, c_Re, c_R, d_R by four readings of Eq (11), and by how much each is off."""
    held = time > 0.0
    first, final = float(np.max(rack.force[held])), float(np.mean(rack.force[time > time[-1] - 1.0]))
    p, lag = float(np.polyfit(yielding[held], rack.force[held], 1)[0]), relaxation.time_constant
    joint = final / relaxation.asymptote

    def of_relaxation(fitted: Relaxation, ramp_time: float) -> Values:
        ratios = final / fitted.asymptote, p, fitted.kappa(ramp_time), fitted.time_constant
        return contact_of_response(*ratios)._asdict()

    # as printed c_xi is the force over the wanted displacement: with p in series the first formula is right
    readings = {
        '': of_relaxation(relaxation, own.ramp_time),
        '_without_ramp_correction': of_relaxation(relaxation, 0.0),
        '_fitted_from_end_of_ramp': of_relaxation(
            fit_relaxation(time, rack.displacement, own.ramp_time), own.ramp_time
        ),
        '_as_printed': printed_formulas(final / own.way, p, first / final, lag)._asdict(),
    }
    true = {name: getattr(own.contact, name) for name in _SYMBOLS}
    breakaway = dynamic_coefficient(own.friction, 0.0, relaxation.asymptote, own.normal_force)
    off = np.abs(relaxation.at(time) - rack.displacement)
    late, during = time >= own.fit_from, held & (time < own.ramp_time)
    return {
        'joint_stiffness_n_per_m': joint,
        'motor_stiffness_n_per_m': p,
        'time_constant_s': lag,
        **{f'parameters{name}': found for name, found in readings.items()},
        'true_parameters': true,
        **{
            f'errors{name}': {key: found[key] / true[key] - 1.0 for key in true}
            for name, found in readings.items()
        },
        'damping_error_as_printed': readings['']['tangential_stiffness'] * lag / true['tangential_damping']
        - 1.0,
        'highest_force_n': first,
        'final_force_n': final,
        'breakaway_force_n': own.normal_force * breakaway,
        'fit_error_late_m': off[late].max(),
        'fit_error_during_ramp_m': off[during].max(),
        'fit_error_between_m': off[held & ~during & ~late].max(),
    }


@claim('Sec. 4', paper='The whole test stays in microslip: nothing slides.')
def _on_microslip(found):
    told = f"""The force peaks at {found['highest_force_n']:.1f} N; at {found['normal_force']:g} N normal
        force the pads break away at {found['breakaway_force_n']:.1f} N (positive direction)."""
    return found['highest_force_n'] < found['breakaway_force_n'], told


@claim(
    'Fig. 7, Eq (10)',
    paper='An exponential meets the measured displacement well for times above 1 s; before, the ramp shows.',
)
def _on_relaxation(found):
    late, ramp = found['fit_error_late_m'], found['fit_error_during_ramp_m']
    told = f"""From {found['fit_from']:g} s on it lies within {1e9 * late:.0f} nm of the recording, during
        the ramp up to {1e6 * ramp:.1f} um off; right behind the ramp it fits again
        ({1e9 * found['fit_error_between_m']:.0f} nm), because the contact is linear."""
    return late < 0.1 * ramp, told


@claim('Eq (11)', paper='c_Re, c_R and d_R follow from the joint stiffness, p, the asymptote and T.')
def _on_formulas(found):
    whole = found['errors_fitted_from_end_of_ramp']
    told = f"""In its right form, with the amplitude corrected for the ramp: {_told(found['errors'])}.
        Without that correction: {_told(found['errors_without_ramp_correction'])}. Fitted from the end of
        the ramp on, where the fading is still large against the noise: {_told(whole)}."""
    return _worst(found['errors']) < 0.03 or (_worst(whole) < 0.03 and PARTLY), told


@claim('Eq (11) as printed', paper='The same three formulas, taken literally.')
def _on_print(found):
    printed = found['errors_as_printed']
    told = f"""With k as first over last force and c_xi as force over the wanted displacement, the first
    formula is right but for the ramp: {_told(printed)}. The second is right only with c_xi over
        the measured displacement, where the first is wrong; the third omits p: with the right c_R it
        gives d_R {100 * found['damping_error_as_printed']:+.1f} %. No reading makes all three right."""
    return _worst(printed) <= 0.05, told


def _worst(errors: dict[str, float]) -> float:
    return max(map(abs, errors.values()))


def _told(errors: dict[str, float]) -> str:
    return ', '.join(f'{_SYMBOLS[name]} {100 * error:+.1f} %' for name, error in errors.items())


def draw_relaxation(
    rack: FrictionRecording,
    time: FloatArray,
    yielding: FloatArray,
    relaxation: Relaxation,
    figures: Values,
    fit_from: float,
) -> Any:
    """Draw force over displacement and over what the motor gives way, and the relaxation, Fig. 7."""
    figure, (left, middle, right) = new_panels(
        'Ramp and hold in microslip: step one of the identification (Fig. 7)', 1, 3, 4.2
    )
    recorded = {'color': BLUE, 'linewidth': 0.8, 'label': 'recorded'}
    fitted = {'color': RED, 'linestyle': '--', 'linewidth': 1.0}
    x = 1e6 * rack.displacement
    for axes, way, last, stiffness, name, label in (
        (left, x, x[-1], figures['joint_stiffness_n_per_m'], 'c_xi', 'displacement x (µm)'),
        (
            middle,
            1e6 * yielding,
            1e6 * yielding.max(),
            figures['motor_stiffness_n_per_m'],
            'p',
            'wanted minus measured (µm)',
        ),
    ):
        axes.plot(way, rack.force, **recorded)
        reach, per_um = np.array([0.0, last]), 1e-6 * stiffness
        axes.plot(reach, per_um * reach, label=f'{name} = {per_um:.2f} N/um', **fitted)
        axes.set(xlabel=label, ylabel='friction force (N)')
    right.plot(time, x, **recorded)
    after = time[time > 0.0]
    right.plot(
        after, 1e6 * relaxation.at(after), label=f'Eq (10), T = {relaxation.time_constant:.3f} s', **fitted
    )
    right.axvline(fit_from, color=GREY, linestyle=':', linewidth=1.0, label='fitted from here')
    right.set(xlabel='time from the start of the ramp (s)', ylabel='displacement x (µm)')
    for axes in (left, middle, right):
        axes.legend(fontsize='small')
    return figure


EXPERIMENT = Experiment(
    NAME,
    """The motor of the rack, a spring p in series with the pads, pulls them by a short ramp and holds.
    Nothing slides; the parallel pair of spring and damper relaxes. The joint stiffness comes from the
    last second, p from the force over the yield of the motor, T and the amplitude from an
    exponential fitted to the displacement. Normal force, p and ramp are chosen: the paper gives none
    of them.""",
    RampParameters(),
    run,
)
