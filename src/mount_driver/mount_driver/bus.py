"""Opens the CAN bus: SocketCAN in the car, UDP multicast on one machine, a virtual bus in one process.

Whatever goes wrong ends in a `CanLinkError` whose text says what was tried and what to do.
"""

import contextlib
import errno
import os
import socket
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from mount_driver.can_library import VirtualBus, can
from mount_driver.loopback import LoopbackMulticastBus

MULTICAST_GROUP = '239.74.163.2'  # python-can's default IPv4 group, of administrative scope
MULTICAST_PORT = 43113  # python-can's default port

# Measured: the usual 208 KiB hold 256 frames, a quarter of a second at 1 kHz; 4 MiB, which the kernel
# doubles, hold 10000.
_RECEIVE_BUFFER = 4 * 1024 * 1024  # bytes; the kernel gives what net.core.rmem_max allows
_CAN_FD_MTU = 72  # bytes: what the kernel shows for an interface in FD mode
_MOST_UNREADABLE = 1000  # without a pause, chosen: then the bus itself is taken for broken


class CanLinkError(OSError):
    """The CAN bus could not be opened or is lost; the text says what was tried and the remedy."""


def open_bus(
    interface: str,
    channel: str,
    *,
    receive: Sequence[int] = (),
    port: int = MULTICAST_PORT,
    bitrate: int = 500_000,
    data_bitrate: int = 2_000_000,
) -> can.BusABC:
    """Return an open CAN FD bus that delivers the frames with the identifiers `receive` (empty: all).

    `port` is that of `udp_multicast`; `bitrate` and `data_bitrate` (bit/s) are for adapters that
    python-can sets up itself: those of SocketCAN are set with `ip link`. Raises `CanLinkError`.
    """
    filters = [{'can_id': number, 'can_mask': 0x7FF, 'extended': False} for number in receive] or None
    tried = f'CAN interface {interface!r}, channel {channel!r}'
    try:
        if interface == 'udp_multicast':
            tried += f', port {port}'
            bus: can.BusABC = LoopbackMulticastBus(channel, port, can_filters=filters)
        elif interface == 'socketcan':
            _check_socketcan(channel)
            bus = _python_can_bus(interface, channel, filters)
        elif interface == 'virtual':
            bus = _python_can_bus(interface, channel, filters, protocol=can.CanProtocol.CAN_FD)
        else:
            tried += f', {bitrate} and {data_bitrate} bit/s'
            bus = _python_can_bus(interface, channel, filters, bitrate=bitrate, data_bitrate=data_bitrate)
    except Exception as error:
        # The adapters of python-can raise whatever they like, even NameError where a driver is missing.
        remedy = _remedy(interface, channel, error, bitrate, data_bitrate)
        raise CanLinkError(f'{tried} does not open: {error}; {remedy}') from error
    _widen_receive_buffer(bus)
    return bus


class Reception:
    """Receives frame by frame; one that python-can cannot read is counted and costs nothing but itself."""

    def __init__(self) -> None:
        self.unreadable = 0
        """Frames and datagrams that could not be read."""
        self.reason = ''
        """Why the last one of them could not."""

    def frame(self, bus: can.BusABC, wait: float) -> can.Message | None:
        """Return the frame that comes within `wait` s, None if none does; raises `can.CanError`."""
        for _ in range(_MOST_UNREADABLE):
            try:
                return bus.recv(wait)
            except can.CanError:
                raise
            except Exception as error:
                # What python-can and its adapters make of foreign bytes raises whatever they lead to.
                self.unreadable += 1
                self.reason = f'{type(error).__name__}: {error}'
                wait = 0.0
        raise can.CanOperationError(f'{_MOST_UNREADABLE} frames in a row not readable; {self.reason}')


def may_have_frames(bus: can.BusABC) -> bool:
    """Return False only where nothing can be received now; costs less than trying."""
    return not (isinstance(bus, VirtualBus) and not bus.queue.queue)


def _python_can_bus(interface: str, channel: str, filters: Any, **options: Any) -> can.BusABC:
    # Without python-can's configuration files: only our own parameters decide.
    return can.Bus(
        interface=interface, channel=channel, can_filters=filters, fd=True, ignore_config=True, **options
    )


def _check_socketcan(channel: str, interfaces: Path = Path('/sys/class/net')) -> None:
    """Refuse an interface that is missing, down or not in FD mode, which would show only when sending."""
    folder = interfaces / channel
    if not folder.exists():
        known = sorted(path.name for path in interfaces.glob('*can*'))
        raise OSError(f'no such network interface; there are {", ".join(known) or "no CAN interfaces"}')
    if (folder / 'operstate').read_text().strip() == 'down':
        raise OSError('the interface is down')
    mtu = int((folder / 'mtu').read_text())
    if mtu != _CAN_FD_MTU:
        raise OSError(f'the interface is not in CAN FD mode: its MTU is {mtu}, needed is {_CAN_FD_MTU}')


def _remedy(interface: str, channel: str, error: Exception, bitrate: int, data_bitrate: int) -> str:
    number = getattr(error, 'errno', None)
    if interface == 'socketcan':
        if number in (errno.EAFNOSUPPORT, errno.EPROTONOSUPPORT):
            return 'this kernel has no CAN sockets: load can_raw, or use udp_multicast on one machine'
        settings = f'type can bitrate {bitrate} dbitrate {data_bitrate} fd on'
        return f'is it up? `ip link set {channel} up {settings}`'
    if interface == 'udp_multicast':
        if isinstance(error, ValueError):
            return f'the channel must be an IPv4 multicast address such as {MULTICAST_GROUP}'
        if number in (errno.EADDRNOTAVAIL, errno.ENODEV, errno.ENETUNREACH):
            return 'the loopback interface is down: `ip link set lo up`'
        return 'is the port free, and may this user open UDP sockets?'
    known = ', '.join(sorted(can.VALID_INTERFACES))
    if interface not in can.VALID_INTERFACES:
        return f'known interfaces are {known}'
    return 'is the adapter plugged in, its driver installed and does it know CAN FD?'


def _widen_receive_buffer(bus: can.BusABC) -> None:
    try:
        number = bus.fileno()
    except NotImplementedError:
        return  # buses without a socket have a queue without a limit
    with contextlib.suppress(OSError), socket.socket(fileno=os.dup(number)) as sock:
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _RECEIVE_BUFFER)
