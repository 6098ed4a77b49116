"""CAN frames between the processes of one machine, as UDP multicast over its loopback interface.

The datagrams are those of python-can's own `udp_multicast` interface, which can listen in. That interface
joins the group on the default route, so it needs a network; this one joins on the loopback interface, so
it works without any, and no frame that moves an actuator can leave the machine.
"""

import ctypes
import ipaddress
import math
import select
import socket
import struct
from typing import Any

import msgpack

from mount_driver.can_library import can, pack_message

_LOOPBACK = '127.0.0.1'
_LARGEST_DATAGRAM = 4096  # bytes; a frame takes about 200
_SO_ATTACH_FILTER = 26  # Linux, asm-generic/socket.h
_SO_TIMESTAMPNS = 35  # Linux, asm-generic/socket.h: the kernel tells when a datagram arrived
_TIME = struct.Struct('@ll')  # s, ns
_ROOM_FOR_TIME = socket.CMSG_SPACE(_TIME.size)


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
            datagram, told, _, _ = self._socket.recvmsg(_LARGEST_DATAGRAM, _ROOM_FOR_TIME)
        except BlockingIOError:
            return None, False
        except OSError as error:
            raise can.CanOperationError(f'receiving failed: {error.strerror}', error.errno) from error
        message = _message(datagram, _arrival(told))
        # Like SocketCAN: error frames pass the filter, because they tell the state of the bus.
        return message, message.is_error_frame or message.arbitration_id in self._received

    def _apply_filters(self, filters: Any) -> None:
        self._received = {entry['can_id'] for entry in filters or ()}  # what is not here python-can looks at


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


def _arrival(told: list[tuple[int, int, bytes]]) -> float:
    """Return the system time (s) at which the kernel received the datagram; NaN where it did not say."""
    for level, kind, data in told:
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
