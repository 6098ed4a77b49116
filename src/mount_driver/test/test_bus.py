"""Buses open, filter, hold a burst, and say what is wrong when they do not open."""

import contextlib
import time
from copy import deepcopy

import msgpack
import pytest

from mount_driver.bus import CanLinkError, Frame, Reception, _check_socketcan, open_bus
from mount_driver.can_library import can


def frame(number, data=b'\x01' * 24, **options):
    return can.Message(arbitration_id=number, is_extended_id=False, is_fd=True, data=data, **options)


@contextlib.contextmanager
def both_ends(interface, multicast):
    """Yield two ends of a bus, of which the second receives two identifiers alone."""
    group, port = multicast
    arguments = (interface, group if interface == 'udp_multicast' else f'test-{port}')
    with (
        open_bus(*arguments, port=port) as far,
        open_bus(*arguments, port=port, receive=(0x210, 0x212)) as near,
    ):
        yield far, near


@pytest.fixture(params=['udp_multicast', 'virtual'])
def pair(request, multicast):
    with both_ends(request.param, multicast) as ends:
        yield ends


def test_a_frame_tells_when_it_arrived_not_when_it_was_read(pair):
    far, near = pair
    for _ in range(50):  # the kernel begins to stamp a moment after the first socket has asked for it
        before = time.time()
        far.send(frame(0x210))
        after = time.time()
        time.sleep(0.02)
        arrived = near.recv(10.0).timestamp
        assert arrived >= before
        if arrived <= after:
            return
    pytest.fail(f'{arrived - after:g} s after it was sent, so it was stamped when it was read')


def test_frames_with_other_identifiers_are_filtered_out(pair):
    far, near = pair
    near.send(frame(0x210))  # its own does not come back
    for number in (0x211, 0x213, 0x212):
        far.send(frame(number))
    assert near.recv(10.0).arbitration_id == 0x212
    assert near.recv(0.0) is None


def test_a_burst_of_half_a_second_is_held(multicast):
    group, port = multicast
    with open_bus('udp_multicast', group, port=port) as far:
        near = open_bus('udp_multicast', group, port=port)
        for number in range(500):
            far.send(frame(number))
        received = [message.arbitration_id for message in iter(lambda: near.recv(0.0), None)]
        near.shutdown()
    assert received == list(range(500))


def test_error_frames_pass_the_filter(multicast):
    with both_ends('udp_multicast', multicast) as (far, near):
        far.send(can.Message(arbitration_id=0x40, is_extended_id=False, is_error_frame=True, dlc=8))
        assert near.recv(10.0).is_error_frame


FIELDS = {'arbitration_id': 0x210, 'data': bytes(24), 'dlc': 24, 'is_extended_id': False, 'is_fd': True}
FOREIGN = [b'\xc1', msgpack.packb([1, 2, 3]), msgpack.packb(FIELDS | {'data': 'x' * 24})]


@pytest.mark.parametrize('datagram', FOREIGN)
def test_a_datagram_that_is_no_frame_is_counted_and_the_next_frame_comes(multicast, datagram):
    with both_ends('udp_multicast', multicast) as (far, near):
        reception = Reception()
        far._sender.sendto(datagram, multicast)
        far.send(frame(0x210))
        assert reception.frame(near, 10.0).arbitration_id == 0x210
    assert reception.unreadable == 1
    assert reception.reason


def test_a_bus_that_reads_nothing_any_more_is_lost(multicast):
    group, port = multicast
    with open_bus('udp_multicast', group, port=port) as near:
        near.recv = lambda wait: [][0]
        with pytest.raises(can.CanOperationError, match='1000 frames in a row not readable; IndexError'):
            Reception().frame(near, 0.0)


@pytest.mark.parametrize(
    ('interface', 'channel', 'sentence'),
    [
        ('udp_multicast', '192.0.2.1', 'no multicast address; the channel must be an IPv4 multicast address'),
        ('udp_multicast', 'can0', 'the channel must be an IPv4 multicast address such as 239'),
        ('socketcan', 'no-such-can', 'ip link set no-such-can up type can bitrate 500000 dbitrate 2000000'),
        ('pcan', 'PCAN_USBBUS1', 'known interfaces are socketcan, .*: an adapter has a socketcan interface'),
    ],
)
def test_a_bus_that_does_not_open_says_what_was_tried_and_the_remedy(interface, channel, sentence):
    with pytest.raises(CanLinkError, match=sentence) as caught:
        open_bus(interface, channel)
    assert f"CAN interface '{interface}', channel '{channel}'" in str(caught.value)


@pytest.mark.parametrize(
    ('state', 'mtu', 'sentence'),
    [
        ('up', 72, ''),
        ('down', 72, 'is down'),
        ('up', 16, 'not in CAN FD mode: its MTU is 16'),
        ('missing', 72, 'no such'),
    ],
)
def test_a_socketcan_interface_is_refused_only_where_it_cannot_carry_fd_frames(
    tmp_path, state, mtu, sentence
):
    folder = tmp_path / 'can0'
    if state != 'missing':
        folder.mkdir()
        (folder / 'operstate').write_text(f'{state}\n')
        (folder / 'mtu').write_text(f'{mtu}\n')
    with pytest.raises(OSError, match=sentence) if sentence else contextlib.nullcontext():
        _check_socketcan('can0', tmp_path)


def test_a_deep_copy_of_our_frame_is_equal_and_shares_nothing():
    ours = Frame(0x123, bytearray(range(24)))
    ours.timestamp = 5.0
    copied = deepcopy(ours)
    assert copied.equals(ours, timestamp_delta=0.0)
    ours.data[0] = 99
    assert copied.data == bytearray(range(24))
    assert (ours.is_extended_id, ours.is_fd, ours.bitrate_switch) == (False, True, True)
