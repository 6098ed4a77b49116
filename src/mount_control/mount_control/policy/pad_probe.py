"""No damper but a diagnosis: pulses of constant current at standstill show how much the pads rub.

The engine idles, and its line in the displacement is smaller while the pads rub. After `wait` come `pulses`
pulses, as long as the pauses between, then 0 A until the next activation; 0 A too from the sample on whose
displacement is farther from the mean than an idling engine moves. The displacement changes nothing else, and
no policy takes anything from the result: `engine-mount identify pads` reads the recording.

The friction that is wanted rises by the square of the number of the pulse, F_k = F (k / n)^2, so that
engines which idle softly and roughly find a force that halves their line. It is made by the friction that is
assumed: a normal force that is the same in every probe, whatever the pads have become.
"""

from typing import Annotated, NamedTuple

from mount_control.policy.contract import Design
from mount_models.arithmetic.compiled import compiled
from mount_models.arithmetic.record import record_type
from mount_models.quantity import Quantity

SLIDING = 0.01  # m/s, chosen: about what the engine's line makes; the coefficient is assumed at this velocity
_MEAN_TIME = 0.5  # s, chosen: longer than a period of what moves the engine


class Parameters(NamedTuple):
    """Parameters of the pulses, and of the movement that ends them."""

    friction_force: Annotated[
        float, Quantity('N', 'F: friction of the last pulse, as it is assumed', 5.0, 200.0)
    ] = 50.0
    pulses: Annotated[float, Quantity('1', 'n: number of pulses', 1.0, 100.0)] = 10.0
    pulse_duration: Annotated[float, Quantity('s', 'length of a pulse, and of each pause', 0.2, 10.0)] = 1.0
    wait: Annotated[float, Quantity('s', '0 A before the first pulse', 0.1, 60.0)] = 3.0
    largest_movement: Annotated[
        float,
        Quantity('m', 'distance from the mean displacement that ends the probe: the car moves', 1e-5, 5e-3),
    ] = 0.0004


class Law(NamedTuple):
    """Parameters of a step, times in samples."""

    force_unit: float
    samples: int
    pulse: int
    wait: int
    averaging: float
    largest_movement: float


STATE = record_type([('samples', 'i8'), ('moved', 'i8'), ('mean', 'f8')])
TRACE = {'predicted_velocity': 'm/s', 'movement': 'm', 'pulse': '1'}


def design(parameters: Parameters, sample_time: float) -> Design:
    """Return the law; every set of parameters within its ranges works."""
    pulse, wait = (max(1, round(time / sample_time)) for time in (parameters.pulse_duration, parameters.wait))
    count = round(parameters.pulses)
    return Design(
        Law(
            parameters.friction_force / (count * count),
            wait + (2 * count - 1) * pulse,
            pulse,
            wait,
            sample_time / _MEAN_TIME,
            parameters.largest_movement,
        )
    )


@compiled
def start(law, state, window, displacement):
    """Set a memory of zeros to a mount at rest at `displacement` (m), before the first pulse."""
    state.mean = displacement


@compiled
def transfer(law, new_law, state, window, new_window):
    """Go on with the same sample of the probe; one that has ended stays so."""
    if state.samples >= law.samples:
        state.moved = 1


@compiled
def step(law, table, state, window, trace, displacement, crank_frequency):
    """Take one sample (m); return force (N) and velocity (m/s) of the pads, and 1 in a pulse, else 0."""
    movement = displacement - state.mean
    state.mean += law.averaging * movement
    pulse = 0.0
    if law.wait <= state.samples < law.samples:
        if abs(movement) > law.largest_movement:
            state.moved = 1
        half = (state.samples - law.wait) // law.pulse
        if half % 2 == 0 and state.moved == 0:
            pulse = half // 2 + 1.0
    if state.samples < law.samples:
        state.samples += 1
    trace.movement = movement
    trace.pulse = pulse
    trace.predicted_velocity = SLIDING if pulse > 0.0 else 0.0
    return law.force_unit * pulse * pulse, trace.predicted_velocity, min(pulse, 1.0)
