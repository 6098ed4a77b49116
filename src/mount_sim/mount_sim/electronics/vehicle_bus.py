"""What the simulated vehicle sends of its engine: `dbc/vehicle.dbc`, every 10 ms."""

from pathlib import Path
from typing import Any

from mount_driver.bus import Frame
from mount_driver.engine_speed import EngineSpeedParameters, SpeedSignal
from mount_models.quantity import flattened

_PARAMETERS = EngineSpeedParameters(
    dbc=str(Path(__file__).parents[1] / 'dbc' / 'vehicle.dbc'), message='EngineData', signal='EngineSpeed'
)
READ_BY_DRIVER: dict[str, Any] = flattened(_PARAMETERS, 'engine_speed')
"""{parameter: value} with which mount_driver reads the speed of the engine."""
PERIOD = 0.01  # s
_SIGNAL = SpeedSignal(_PARAMETERS)
IDENTIFIER: int = _SIGNAL.message.frame_id
_IGNITIONS = 2.0  # chosen: of four cylinders in a turn of the crankshaft


def sent_every(sample_rate: float) -> int:
    """Return the samples from one message to the next."""
    return round(PERIOD * sample_rate)


def speed_frame(ignition_frequency: float) -> Frame:
    """Return the message of an engine that ignites so often (Hz)."""
    rpm = 60.0 * ignition_frequency / _IGNITIONS
    return Frame(IDENTIFIER, _SIGNAL.message.encode({'EngineSpeed': rpm}))


def received_velocity(ignition_frequency: float) -> float:
    """Return the speed (rad/s) as mount_driver publishes it."""
    velocity = _SIGNAL.velocity(speed_frame(ignition_frequency).data)
    assert velocity is not None
    return velocity
