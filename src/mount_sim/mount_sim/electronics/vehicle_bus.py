"""What the simulated vehicle sends of its engine: `dbc/vehicle.dbc`, every 10 ms."""

from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from mount_driver.bus import Frame
    from mount_driver.engine_speed import SpeedSignal

_DBC, _MESSAGE, _SIGNAL = str(Path(__file__).parents[1] / 'dbc' / 'vehicle.dbc'), 'EngineData', 'EngineSpeed'
READ_BY_DRIVER = {
    'engine_speed.dbc': _DBC,
    'engine_speed.message': _MESSAGE,
    'engine_speed.signal': _SIGNAL,
}
"""{parameter: value} with which mount_driver reads the speed of the engine."""
PERIOD = 0.01  # s
_IGNITIONS = 2.0  # chosen: of four cylinders in a turn of the crankshaft


@cache
def speed_signal() -> 'SpeedSignal':
    """Return the signal of the speed; its DBC is read on the first call."""
    from mount_driver.engine_speed import EngineSpeedParameters, SpeedSignal  # loads the libraries of CAN

    return SpeedSignal(EngineSpeedParameters(dbc=_DBC, message=_MESSAGE, signal=_SIGNAL))


def sent_every(sample_rate: float) -> int:
    """Return the samples from one message to the next."""
    return round(PERIOD * sample_rate)


def speed_frame(ignition_frequency: float) -> 'Frame':
    """Return the message of an engine that ignites so often (Hz)."""
    from mount_driver.bus import Frame

    message, rpm = speed_signal().message, 60.0 * ignition_frequency / _IGNITIONS
    return Frame(message.frame_id, message.encode({_SIGNAL: rpm}))


def received_velocity(ignition_frequency: float) -> float:
    """Return the speed (rad/s) as mount_driver publishes it."""
    velocity = speed_signal().velocity(speed_frame(ignition_frequency).data)
    assert velocity is not None
    return velocity
