"""What of a manoeuvre can be limited: names with their units, what they mean, and where they can be told."""

from dataclasses import dataclass

BANDS = ((3.0, 14.0), (14.0, 20.0), (20.0, 30.0), (30.0, 50.0), (20.0, 200.0))
"""Hz: resonance of the engine; the isolation bands of the sweep; what the chassis passes on as sound."""
REFERENCES = ('hydromount', 'undamped')
ROAD, RACK = 'road', 'rack'


@dataclass(frozen=True)
class Measure:
    """What a number means, its unit ('' for counts and ratios), and on which seat it can be told.

    `clock`: it is one of real time and not judged in core and lock-step.
    """

    unit: str
    meaning: str
    seats: tuple[str, ...] = (ROAD, RACK)
    clock: bool = False


def _beside(name: str, what: str, seats: tuple[str, ...]) -> dict[str, Measure]:
    return {
        f'{name}_over_{other}': Measure('', f'{what}, over that of the {other} mount', seats)
        if other == 'undamped'
        else Measure('', f'{what}, over that of the hydromount', seats)
        for other in REFERENCES
    }


MEASURES: dict[str, Measure] = {
    'peak_displacement_mm': Measure('mm', 'largest displacement', (ROAD,)),
    **_beside('peak', 'largest displacement', (ROAD,)),
    'rms_displacement_mm': Measure('mm', 'rms displacement', (ROAD,)),
    **_beside('rms', 'rms displacement', (ROAD,)),
    'first_extremum_mm': Measure('mm', 'first clear turning point of the displacement', (ROAD,)),
    **_beside('first_extremum', 'first clear turning point of the displacement', (ROAD,)),
    'ringing_s': Measure('s', 'until the displacement stays below a fifth of the undamped peak', (ROAD,)),
    **_beside('ringing', 'time until it stays below a fifth of the undamped peak', (ROAD,)),
    **{
        name: measure
        for low, high in BANDS
        for name, measure in _beside(
            f'chassis_{low:g}_{high:g}hz', f'rms chassis acceleration, {low:g} to {high:g} Hz', (ROAD,)
        ).items()
    },
    'distortion_percent': Measure('%', 'harmonic distortion of the mount force', (RACK,)),
    'distortion_over_hydromount': Measure('', 'that, over that of the hydromount', (RACK,)),
    'cycle_loss_j': Measure('J', 'work of the mount force per period', (RACK,)),
    'cycle_loss_over_hydromount': Measure('', 'that, over that of the hydromount', (RACK,)),
    'friction_error_percent': Measure('%', 'rms friction force error over the largest wanted force'),
    'switched_on': Measure('', 'how often damping went on'),
    'damping_share_percent': Measure('%', 'share of the time with damping on'),
    'pad_energy_j': Measure('J', 'work of friction, by which the pads wear'),
    'peak_current_a': Measure('A', 'largest current setpoint of the controller'),
    'coil_power_w': Measure('W', 'mean heat of the coil'),
    'rest_gap_error_um': Measure('µm', 'size of the error of the estimated rest gap'),
    'contact_gap_error_um': Measure('µm', 'size of the error of the estimated contact gap'),
    'lost_samples': Measure('', 'samples that the recording lacks'),
    'unanswered_samples': Measure('', 'samples without a setpoint while control was active'),
    'faults': Measure('', 'faults told by nodes and electronics'),
    'remarks': Measure('', 'what else was not as it should be, by sentences'),
    'latency_p99_us': Measure('µs', '99 of 100 setpoints came back within', clock=True),
}
"""{name: what it means}. A number that is not known is exceeded, whatever its limit."""
