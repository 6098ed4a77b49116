"""The CAN bus: SocketCAN in the car, UDP multicast on one machine, a virtual bus in one process.

Every failure ends in a `CanLinkError` whose text says what was tried and what to do.

The datagrams of UDP multicast are those of python-can's own `udp_multicast` interface, which can listen in.
That interface joins the group on the default route, so it needs a network. `LoopbackMulticastBus` joins on
the loopback interface: it needs none, and no frame that moves an actuator can leave the machine.
"""

import ctypes
import errno
import ipaddress
import select
import socket
import struct
from collections.abc import Sequence
from math import nan
from pathlib import Path
from typing import Any

import msgpack

from mount_driver.can_library import SocketcanBus, VirtualBus, can, pack_message

MULTICAST_GROUP = '239.74.163.2'  # python-can's default IPv4 group, of administrative scope
MULTICAST_PORT = 43113  # python-can's default port

# Measured: the usual 208 KiB hold 256 frames, a quarter of a second at 1 kHz; 4 MiB, which the kernel
# doubles, hold 10000.
_RECEIVE_BUFFER = 4 * 1024 * 1024  # bytes; the kernel gives what net.core.rmem_max allows
_CAN_FD_MTU = 72  # bytes: what the kernel shows for an interface in FD mode
_MOST_UNREADABLE = 1000  # without a pause, chosen: then the bus itself is taken for broken
_LOOPBACK = '127.0.0.1'
_ANCILLARY = 64  # bytes: room for the time of arrival
_LARGEST_DATAGRAM = 4096  # bytes; a frame takes about 200
_SO_ATTACH_FILTER = 26  # Linux, asm-generic/socket.h
_SO_TIMESTAMPNS = 35  # Linux, asm-generic/socket.h: the kernel adds the time of arrival
_TIME = struct.Struct('@ll')  # s, ns


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
    extended: bool = False,
    any_rate: bool = False,
) -> can.BusABC:
    """Return an open CAN FD bus that delivers the frames with the identifiers `receive` (empty: all).

    `extended`: they have 29 bits. `any_rate`: a bus without CAN FD serves too, for one who only listens.
    `port` is that of `udp_multicast`; the bit rates of `socketcan` are set with `ip link`. Raises
    `CanLinkError`.
    """
    mask = 0x1FFFFFFF if extended else 0x7FF
    filters = [{'can_id': number, 'can_mask': mask, 'extended': extended} for number in receive] or None
    try:
        if interface == 'udp_multicast':
            return LoopbackMulticastBus(channel, port, can_filters=filters)
        if interface == 'virtual':
            return VirtualBus(channel, protocol=can.CanProtocol.CAN_FD, can_filters=filters)
        if interface == 'socketcan':
            _check_socketcan(channel, any_rate=any_rate)
            bus = SocketcanBus(channel, can_filters=filters, fd=True)
            bus.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _RECEIVE_BUFFER)
            return bus
        raise ValueError('known interfaces are socketcan, udp_multicast and virtual')
    except Exception as error:  # python-can raises whatever it likes
        remedy = _remedy(interface, channel, error)
        tried = f'CAN interface {interface!r}, channel {channel!r}, port {port}'
        raise CanLinkError(f'{tried} does not open: {error}{remedy}') from error


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
        """Send one frame; raises `OSError`."""
        self._sender.sendto(pack_message(msg), self._destination)

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
            datagram, ancillary, _, _ = self._socket.recvmsg(_LARGEST_DATAGRAM, _ANCILLARY)
        except BlockingIOError:
            return None, False
        except OSError as error:
            raise can.CanOperationError(f'receiving failed: {error.strerror}', error.errno) from error
        message = _message(datagram)
        for _, _, data in ancillary:  # the time of arrival alone
            seconds, nanoseconds = _TIME.unpack_from(data)
            message.timestamp = seconds + 1e-9 * nanoseconds
        # Like SocketCAN: error frames pass the filter, because they show the state of the bus.
        return message, message.is_error_frame or message.arbitration_id in self._received

    def _apply_filters(self, filters: Any) -> None:
        self._received = {entry['can_id'] for entry in filters or ()}  # what is not here python-can looks at


def _check_socketcan(
    channel: str, interfaces: Path = Path('/sys/class/net'), *, any_rate: bool = False
) -> None:
    """Refuse an interface that is missing, down or not in FD mode, which would show only when sending."""
    folder = interfaces / channel
    if not folder.exists():
        raise OSError('no such network interface')
    if (folder / 'operstate').read_text().strip() == 'down':
        raise OSError('the interface is down')
    mtu = int((folder / 'mtu').read_text())
    if mtu != _CAN_FD_MTU and not any_rate:
        needed = f'needed is {_CAN_FD_MTU}: set it down, then up in that mode'
        raise OSError(f'the interface is not in CAN FD mode: its MTU is {mtu}, {needed}')


def _remedy(interface: str, channel: str, error: Exception) -> str:
    if interface == 'socketcan':
        if getattr(error, 'errno', None) in (errno.EAFNOSUPPORT, errno.EPROTONOSUPPORT):
            return '; this kernel has no CAN sockets: load can_raw, or use udp_multicast on one machine'
        settings = 'type can bitrate 500000 dbitrate 2000000 fd on'
        return f'; is it up? `ip link set {channel} up {settings}`'
    if interface != 'udp_multicast':
        return ': an adapter has a socketcan interface where Linux has its driver'
    if isinstance(error, ValueError):
        return f'; the channel must be an IPv4 multicast address such as {MULTICAST_GROUP}'
    return '; is the port free and the loopback interface up (`ip link set lo up`)?'


def _message(datagram: bytes) -> can.Message:
    """Return the frame in a datagram; what another program sent raises whatever its content leads to."""
    fields = msgpack.unpackb(datagram)
    # python-can takes any object for an identifier, and a number for so many bytes of data.
    if not (isinstance(fields['arbitration_id'], int) and isinstance(fields['data'], bytes)):
        raise TypeError('a datagram of another form')
    fields['timestamp'] = nan  # that of the sender
    return can.Message(**fields)


def _receiving_socket(channel: str, port: int) -> socket.socket:
    address = ipaddress.IPv4Address(channel)
    if not address.is_multicast:
        raise ValueError(f'{channel} is no multicast address')
    sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    options = (socket.SO_REUSEADDR, 1), (socket.SO_REUSEPORT, 1), (_SO_TIMESTAMPNS, 1)
    for option, value in (*options, (socket.SO_RCVBUF, _RECEIVE_BUFFER)):
        sock.setsockopt(socket.SOL_SOCKET, option, value)
    sock.bind(('', port))
    membership = address.packed + socket.inet_aton(_LOOPBACK)
    sock.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, membership)
    sock.setblocking(False)
    return sock


def _sending_socket() -> socket.socket:
    sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    sock.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
    sock.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton(_LOOPBACK))
    sock.bind(('', 0))
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
