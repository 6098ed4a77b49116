"""Parameters of the driver."""

import math
from typing import Annotated, NamedTuple

from mount_driver.bus import MULTICAST_GROUP, MULTICAST_PORT
from mount_driver.watches.coil_watch import CoilWatchParameters
from mount_driver.watches.message_watches import SenderLimits, StatusLimits
from mount_driver.watches.ripple_watch import RippleWatchParameters
from mount_models.coil.copper import CoilHeating
from mount_models.quantity import Quantity
from mount_models.sampling import SAMPLE_RATE, SETPOINT_TIMEOUT, SampleRate


class DriverParameters(NamedTuple):
    """How the electronics are reached, and when the link is doubted."""

    interface: Annotated[
        str, Quantity('name', 'python-can interface: socketcan, udp_multicast, virtual or any other')
    ] = 'udp_multicast'
    channel: Annotated[str, Quantity('name', 'channel of the interface: can0, or a multicast address')] = (
        MULTICAST_GROUP
    )
    port: Annotated[int, Quantity('1', 'UDP port of udp_multicast', 1024, 65535)] = MULTICAST_PORT
    bitrate: Annotated[
        int,
        Quantity('bit/s', 'arbitration bit rate, for adapters set up by python-can', 10_000, 1_000_000),
    ] = 500_000
    data_bitrate: Annotated[
        int, Quantity('bit/s', 'data bit rate of CAN FD, likewise', 10_000, 8_000_000)
    ] = 2_000_000
    sample_rate: SampleRate = SAMPLE_RATE
    setpoint_timeout: Annotated[
        float,
        Quantity('s', 'greatest age of the sample that a current answers; then 0 A', 0.002, SETPOINT_TIMEOUT),
    ] = SETPOINT_TIMEOUT
    frame_timeout: Annotated[
        float, Quantity('s', 'without a frame for this long the link counts as dead', 0.01, 10.0)
    ] = 0.1
    recovery_time: Annotated[
        float,
        Quantity('s', 'how long opening a lost CAN bus is tried before giving up', 0.0, 3600.0),
    ] = 10.0
    loss_warning: Annotated[
        float,
        Quantity('1', 'share of lost or corrupt samples in 10 s that is warned of', 0.0, 1.0),
    ] = 0.001
    temperature_warning_celsius: Annotated[
        float, Quantity('degC', 'coil temperature that is warned of', -60.0, 250.0)
    ] = 120.0
    coil: CoilWatchParameters = CoilWatchParameters()
    status: StatusLimits = StatusLimits()
    senders: SenderLimits = SenderLimits()
    ripple: RippleWatchParameters = RippleWatchParameters()
    heating: CoilHeating = CoilHeating()
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
    ] = math.nan
