"""The CAN bus: SocketCAN in the car, UDP multicast on one machine, a virtual bus in one process.

Every failure ends in a `CanLinkError` whose text says what was tried and what to do.

The datagrams of UDP multicast are those of python-can's own `udp_multicast` interface, which can listen in.
That interface joins the group on the default route, so it needs a network. `LoopbackMulticastBus` joins on
the loopback interface: it needs none, and no frame that moves an actuator can leave the machine.
"""

import contextlib
import ctypes
import errno
import ipaddress
import math
import os
import select
import socket
import struct
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import msgpack

from mount_driver.can_library import VirtualBus, can, pack_message

MULTICAST_GROUP = '239.74.163.2'  # python-can's default IPv4 group, of administrative scope
MULTICAST_PORT = 43113  # python-can's default port

# Measured: the usual 208 KiB hold 256 frames, a quarter of a second at 1 kHz; 4 MiB, which the kernel
# doubles, hold 10000.
_RECEIVE_BUFFER = 4 * 1024 * 1024  # bytes; the kernel gives what net.core.rmem_max allows
_CAN_FD_MTU = 72  # bytes: what the kernel shows for an interface in FD mode
_MOST_UNREADABLE = 1000  # without a pause, chosen: then the bus itself is taken for broken
_LOOPBACK = '127.0.0.1'
_LARGEST_DATAGRAM = 4096  # bytes; a frame takes about 200
_SO_ATTACH_FILTER = 26  # Linux, asm-generic/socket.h
_SO_TIMESTAMPNS = 35  # Linux, asm-generic/socket.h: the kernel adds the time of arrival
_TIME = struct.Struct('@ll')  # s, ns
_ROOM_FOR_TIME = socket.CMSG_SPACE(_TIME.size)


class CanLinkError(OSError):
    """The CAN bus could not be opened or is lost; the text says what was tried and the remedy."""


class Frame(can.Message):
    """A standard CAN FD frame with bit rate switching, cheap to copy.

    python-can's virtual bus makes a deep copy of each frame that it carries, which for its own class takes
    eight times as long as copying the bytes.
    """

    __slots__ = ()

    def __init__(self, identifier: int, data: bytes | bytearray):
        super().__init__(
            arbitration_id=identifier, data=data, is_extended_id=False, is_fd=True, bitrate_switch=True
        )

    def __deepcopy__(self, _: Any) -> can.Message:
        copied = self.__copy__()
        copied.data = bytearray(self.data)
        return copied


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
    options: dict[str, Any] = {}
    if interface == 'udp_multicast':
        tried += f', port {port}'
    elif interface == 'virtual':
        options['protocol'] = can.CanProtocol.CAN_FD
    elif interface != 'socketcan':
        tried += f', {bitrate} and {data_bitrate} bit/s'
        options |= {'bitrate': bitrate, 'data_bitrate': data_bitrate}
    try:
        if interface == 'socketcan':
            _check_socketcan(channel)
        if interface == 'udp_multicast':
            bus: can.BusABC = LoopbackMulticastBus(channel, port, can_filters=filters)
        else:  # without python-can's configuration files: only our own parameters decide
            options |= {'can_filters': filters, 'fd': True, 'ignore_config': True}
            bus = can.Bus(interface=interface, channel=channel, **options)
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


class LoopbackMulticastBus(can.BusABC):
    """A python-can bus over UDP multicast that stays on this machine (time to live 0, loopback interface)."""

    def __init__(self, channel: str, port: int, can_filters: Any = None, **_: Any):
        self.channel_info = f'udp_multicast {channel}:{port} on the loopback interface'
        self._can_protocol = can.CanProtocol.CAN_FD
        self._destination = (channel, port)
        self._socket = _receiving_socket(channel, port)
        self._sender = _sending_socket()
        _ignore_sender(self._socket, self._sender.getsockname()[1])
        self._poll = select.poll()
        self._poll.register(self._socket, select.POLLIN)
        super().__init__(channel, can_filters)

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Send one frame; raises `can.CanOperationError`."""
        try:
            self._sender.sendto(pack_message(msg), self._destination)
        except OSError as error:
            raise can.CanOperationError(f'sending failed: {error.strerror}', error.errno) from error

    def fileno(self) -> int:
        """Return the receiving socket's file number."""
        return self._socket.fileno()

    def shutdown(self) -> None:
        """Close the sockets; safe to call twice."""
        super().shutdown()
        self._socket.close()
        self._sender.close()

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        try:
            if not self._poll.poll(None if timeout is None else max(timeout, 0.0) * 1e3):
                return None, False
            datagram, ancillary, _, _ = self._socket.recvmsg(_LARGEST_DATAGRAM, _ROOM_FOR_TIME)
        except BlockingIOError:
            return None, False
        except OSError as error:
            raise can.CanOperationError(f'receiving failed: {error.strerror}', error.errno) from error
        message = _message(datagram, _arrival(ancillary))
        # Like SocketCAN: error frames pass the filter, because they show the state of the bus.
        return message, message.is_error_frame or message.arbitration_id in self._received

    def _apply_filters(self, filters: Any) -> None:
        self._received = {entry['can_id'] for entry in filters or ()}  # what is not here python-can looks at


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


def _message(datagram: bytes, arrival: float) -> can.Message:
    """Return the frame in a datagram; what another program sent raises whatever its content leads to."""
    fields = msgpack.unpackb(datagram)
    # python-can takes any object for an identifier, and a number for so many bytes of data.
    if not (isinstance(fields['arbitration_id'], int) and isinstance(fields['data'], bytes)):
        raise TypeError('a datagram of another form')
    fields['timestamp'] = arrival
    return can.Message(**fields)


def _receiving_socket(channel: str, port: int) -> socket.socket:
    address = ipaddress.IPv4Address(channel)
    if not address.is_multicast:
        raise ValueError(f'{channel} is no multicast address')
    sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    try:
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEPORT, 1)
        sock.setsockopt(socket.SOL_SOCKET, _SO_TIMESTAMPNS, 1)
        sock.bind(('', port))
        membership = address.packed + socket.inet_aton(_LOOPBACK)
        sock.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, membership)
        sock.setblocking(False)
    except OSError:
        sock.close()
        raise
    return sock


def _arrival(ancillary: list[tuple[int, int, bytes]]) -> float:
    """Return the system time (s) at which the kernel received the datagram; NaN where it did not say."""
    for level, kind, data in ancillary:
        if (level, kind) == (socket.SOL_SOCKET, _SO_TIMESTAMPNS):
            seconds, nanoseconds = _TIME.unpack_from(data)
            return seconds + 1e-9 * nanoseconds
    return math.nan


def _sending_socket() -> socket.socket:
    sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    try:
        sock.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
        sock.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton(_LOOPBACK))
        sock.bind(('', 0))
    except OSError:
        sock.close()
        raise
    return sock


def _ignore_sender(receiver: socket.socket, sender_port: int) -> None:
    """Keep our own frames from waking us: a BPF program on the source port, the first word of UDP."""
    program = b''.join(
        struct.pack('=HBBI', *instruction)
        for instruction in (
            (0x28, 0, 0, 0),  # load the half word at 0
            (0x15, 0, 1, sender_port),  # our own port?
            (0x06, 0, 0, 0),  # yes: drop
            (0x06, 0, 0, 0xFFFFFFFF),  # no: keep all of it
        )
    )
    buffer = ctypes.create_string_buffer(program)
    description = struct.pack('HL', len(program) // 8, ctypes.addressof(buffer))
    receiver.setsockopt(socket.SOL_SOCKET, _SO_ATTACH_FILTER, description)
