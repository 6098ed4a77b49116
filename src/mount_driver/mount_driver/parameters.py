"""Parameters of the driver."""

from math import nan
from typing import Annotated, NamedTuple

from mount_driver.bus import MULTICAST_GROUP, MULTICAST_PORT
from mount_driver.engine_speed import EngineSpeedParameters
from mount_driver.watches.coil_watch import CoilWatchParameters
from mount_driver.watches.message_watches import StatusLimits
from mount_driver.watches.ripple_watch import RippleWatchParameters
from mount_models.coil.copper import CoilHeating
from mount_models.quantity import Quantity
from mount_models.sampling import SAMPLE_RATE, SampleRate


class DriverParameters(NamedTuple):
    """How the electronics are reached, and when the link is doubted."""

    interface: Annotated[
        str, Quantity('name', 'socketcan in the car, udp_multicast on one machine, virtual in one process')
    ] = 'udp_multicast'
    channel: Annotated[str, Quantity('name', 'channel of the interface: can0, or a multicast address')] = (
        MULTICAST_GROUP
    )
    port: Annotated[int, Quantity('1', 'UDP port of udp_multicast', 1024, 65535)] = MULTICAST_PORT
    sample_rate: SampleRate = SAMPLE_RATE
    shadow: Annotated[
        bool, Quantity('truth', 'serve electronics that compute the law themselves, see mount_control.shadow')
    ] = False
    coil: CoilWatchParameters = CoilWatchParameters()
    status: StatusLimits = StatusLimits()
    ripple: RippleWatchParameters = RippleWatchParameters()
    heating: CoilHeating = CoilHeating()
    engine_speed: EngineSpeedParameters = EngineSpeedParameters()
    coil_celsius_before: Annotated[
        float,
        Quantity(
            'degC',
            'coil temperature at the start, at most 10 s old; NaN: unknown, as hot as current makes it',
            -60.0,
            250.0,
            'told by the supervisor where it starts a driver again',
            may_be_unknown=True,
        ),
    ] = nan
