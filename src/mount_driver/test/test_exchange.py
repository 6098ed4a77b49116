"""Frames in, samples out; setpoints in, frames out; and 0 A on every way out, whatever the bus raises."""

import itertools
import math
import subprocess
import sys
import textwrap
import threading

import pytest
from car import MS, Steady
from far_end import CODEC, FarEnd, sample
from ros_testing import LIMIT, wait_until

from mount_driver import exchange as exchange_module
from mount_driver.bus import open_bus
from mount_driver.can_library import can
from mount_driver.can_messages import Setpoint, TablePoint, table_crc
from mount_driver.clock import CounterClock, ElectronicsClock
from mount_driver.exchange import Exchange
from mount_driver.link import Refusal
from mount_driver.parameters import DriverParameters
from mount_driver.protocol import AliveCounter

OFF = Setpoint(0.0, 0xFFFF, False)
RAISED = [can.CanOperationError('no buffer'), OSError('gone'), ValueError('what?'), KeyboardInterrupt()]
_channels = itertools.count()


class FailingBus:
    """A virtual bus whose calls of `method` with the numbers `failing` raise."""

    def __init__(self, bus, method, failing, error):
        self._bus = bus
        self.calls = dict.fromkeys(('recv', 'send', 'shutdown'), 0)
        self._method, self._failing, self._error = method, failing, error

    def recv(self, timeout):
        self._count('recv')
        return self._bus.recv(timeout)

    def send(self, message):
        self._count('send')
        self._bus.send(message)

    def shutdown(self):
        self._bus.shutdown()
        self._count('shutdown')

    def _count(self, method):
        number = self.calls[method]
        self.calls[method] += 1
        if method == self._method and number in self._failing:
            raise self._error


@pytest.fixture
def make(monkeypatch):
    """Return a function that starts an exchange, on a bus that fails as told; it returns also its far end."""
    genuine, opened = exchange_module.open_bus, []

    def start(*failing, take=lambda stamped: None, lockstep=False, threaded=True, **parameters):
        channel = f'test_exchange_{next(_channels)}'
        far = FarEnd('virtual', channel, 0)

        def opening(*arguments, **options):
            bus = genuine(*arguments, **options)
            return FailingBus(bus, *failing) if failing else bus

        monkeypatch.setattr(exchange_module, 'open_bus', opening)
        chosen = DriverParameters(interface='virtual', channel=channel)._replace(**parameters)
        clock = CounterClock() if lockstep else ElectronicsClock(0)
        exchange = Exchange(chosen, CODEC, clock, take, steady=Steady())
        exchange.start(threaded=threaded)
        opened.append((exchange, far))
        return exchange, far

    yield start
    for exchange, far in opened:
        exchange.stop()
        far.close()


@pytest.fixture
def udp(multicast):
    """Return an exchange that receives in a thread, its far end, and the samples that it hands on."""
    group, port = multicast
    samples, far = [], FarEnd('udp_multicast', group, port)
    exchange = Exchange(DriverParameters(channel=group, port=port), CODEC, CounterClock(), samples.append)
    exchange.start()
    yield exchange, far, samples
    exchange.stop()
    far.close()


def polled(exchange, far, *samples):
    for each in samples:
        far.send(each)
        assert exchange.poll()


def off_frames(far):
    """Return how many setpoint frames have come, all of which must switch off."""
    frames = far.setpoints()
    assert not any(setpoint.enable for setpoint in frames)
    return len(frames)


def test_electronics_of_another_rate_take_the_coil_to_0_a_until_the_next_activation(make):
    exchange, far = make(lockstep=True, threaded=False, sample_rate=2000.0)
    for index in range(30):
        polled(exchange, far, sample(index))
        exchange.send_setpoint(index * MS, 1.0)
    assert 'sample every 1000 us, but sample_rate (2000 Hz) means 500 us' in exchange.link.fault
    assert exchange.link.last_refusal is Refusal.SWITCHED_OFF
    *setpoints, off = far.setpoints()
    assert off._replace(answered_counter=0) == Setpoint(0.0, 0, False)
    assert len(setpoints) == exchange.link.counts.setpoints < 20


@pytest.fixture
def lawful(make):
    """An exchange with electronics of a law of their own, what it hands on, and a function that sends theirs.

    The function returns the points of the table that come in answer.
    """
    exchange, far = make(lockstep=True, threaded=False, shadow=True)
    taken, alive, layout = [], AliveCounter(), CODEC.table_point
    exchange._on_own_setpoint = lambda *own: taken.append(own)
    bus = open_bus('virtual', far.bus.channel_id)
    polled(exchange, far, sample(7))

    def points():
        frames = [
            each for each in iter(lambda: bus.recv(0.0), None) if each.arbitration_id == layout.frame_id
        ]
        return [layout.decode(frame.data)[1] for frame in frames]

    def send(next_point=0, crc=0, current=math.nan, counter=7, number=None):
        number = alive.next() if number is None else number
        data = CODEC.own_setpoint.pack((0, number, counter, next_point, crc, current))
        far.send_raw(CODEC.own_setpoint.frame_id, data)
        exchange.poll()
        return points()

    yield exchange, taken, send, points
    bus.shutdown()


def test_electronics_get_the_point_of_the_table_that_they_wait_for(lawful):
    exchange, taken, send, points = lawful
    table = [(0.5, 0.0), (0.4, 0.0), (0.9, 30.0)]
    crc = table_crc(table)
    assert send() == []
    exchange.give_table(table)
    assert points() == [TablePoint(0, 3, crc, 0.5, 0.0)]
    for _ in range(2):  # a point that was lost
        assert send(1, crc) == [TablePoint(1, 3, crc, 0.4, 0.0)]
    assert send(2, crc + 1) == [TablePoint(0, 3, crc, 0.5, 0.0)]  # of another table
    assert send(3, crc, 0.1, counter=8) == []  # answers no sample that is known
    assert not any(loaded for _, _, loaded in taken)
    assert send(3, crc, 0.1) == []
    assert taken[-1] == (7 * MS, 0.1, True)
    exchange.give_table([])
    assert points() == [TablePoint(0, 0, 0, 0.0, 0.0)]


def test_a_second_sender_of_own_setpoints_takes_the_coil_to_0_a(lawful):
    exchange, _, send, _ = lawful
    for _ in range(4):
        send(current=0.1)
    assert not exchange.link.fault
    for current in (0.2, 0.3, 0.4):
        send(current=current, number=3)
    assert 'MountOwnSetpoint' in exchange.link.fault


@pytest.mark.parametrize(
    'odd',
    [
        {'data': bytes(64), 'dlc': 64},
        {'data': b'', 'is_fd': False, 'is_remote_frame': True, 'dlc': 8},
        {'data': bytes(24), 'is_extended_id': True},
        {'data': bytes(8), 'is_fd': False, 'is_error_frame': True},
    ],
)
def test_a_frame_of_another_form_costs_itself_alone(udp, odd):
    exchange, far, samples = udp
    far.send_raw(CODEC.measurement.frame_id, **odd)
    far.send(sample(1))
    wait_until(lambda: samples, 'the sample')
    assert samples == [(MS, sample(1))]
    assert exchange.failure == ''


def test_in_lock_step_the_stamps_switch_off_and_no_other_clock(make):
    exchange, far = make(lockstep=True, threaded=False)
    exchange._steady.now += 1000 * MS
    assert not exchange.poll()
    polled(exchange, far, sample(100))
    exchange.send_setpoint(100 * MS, 2.0)
    exchange._steady.now += 1000 * MS
    polled(exchange, far, sample(120))
    assert far.setpoints() == [Setpoint(2.0, 100, True)]
    polled(exchange, far, sample(121))
    assert far.setpoints() == [Setpoint(0.0, 100, False)]


def test_a_sample_sent_again_gets_its_answer_again_if_it_has_one(make):
    samples = []
    exchange, far = make(lockstep=True, threaded=False, take=samples.append)
    polled(exchange, far, sample(5), sample(5))
    exchange.send_setpoint(5 * MS, 1.5)
    polled(exchange, far, sample(5))
    first, again = far.bus.recv(0.0).data, far.bus.recv(0.0).data
    assert CODEC.setpoint.decode(again)[1] == CODEC.setpoint.decode(first)[1] == Setpoint(1.5, 5, True)
    assert again[2] == first[2] + 1  # a frame of its own by its alive counter
    assert far.bus.recv(0.0) is None
    assert (len(samples), exchange.link.counts.resent) == (1, 2)


@pytest.mark.parametrize('threaded', [True, False])
@pytest.mark.parametrize(
    ('error', 'failure'),
    [
        (RuntimeError('no context'), 'RuntimeError: no context'),
        (RAISED[0], 'CAN bus lost (no buffer): activate mount_driver again when it is back'),
    ],
)
def test_an_error_where_frames_are_received_ends_the_exchange_at_0_ampere(make, threaded, error, failure):
    def fail(stamped):
        raise error

    exchange, far = make(take=fail, threaded=threaded)
    far.send(sample(0))
    assert threaded or not exchange.poll()
    wait_until(lambda: exchange.failure, 'a failure')
    assert exchange.failure == failure
    wait_until(lambda: not exchange._accepting, 'the end')
    assert off_frames(far) == 3
    assert not exchange.send_setpoint(0, 1.0)
    assert exchange.link.last_refusal is Refusal.BUS_LOST


def test_bus_off_drops_setpoints_until_a_sample_comes_again(udp):
    exchange, far, samples = udp
    far.send(sample(0))
    far.send_raw(0x40, bytes(8), is_error_frame=True, is_fd=False)
    wait_until(lambda: exchange.bus_off, 'bus off')
    assert not exchange.send_setpoint(0, 1.0)
    assert exchange.link.last_refusal is Refusal.BUS_LOST
    far.send(sample(1))
    wait_until(lambda: len(samples) == 2, 'a sample')
    assert exchange.send_setpoint(1 * MS, 1.0)
    assert exchange.link.counts.error_frames == 1


def test_a_process_that_ends_by_an_exception_sends_0_ampere(multicast):
    group, port = multicast
    far = FarEnd('udp_multicast', group, port)
    program = f"""
        from mount_driver.clock import CounterClock
        from mount_driver.protocol import MountCodec
        from mount_driver.exchange import Exchange
        from mount_driver.parameters import DriverParameters

        parameters = DriverParameters(channel={group!r}, port={port})
        exchange = Exchange(parameters, MountCodec(), CounterClock(), print)
        exchange.start()
        raise SystemError('crash')
        """
    ended = subprocess.run([sys.executable, '-c', textwrap.dedent(program)], capture_output=True, timeout=60)
    assert b'SystemError: crash' in ended.stderr
    assert far.setpoint() == OFF
    far.close()


@pytest.mark.parametrize('error', RAISED, ids=lambda error: type(error).__name__)
@pytest.mark.parametrize(
    ('method', 'numbers'),
    [('send', {0}), ('send', {1}), ('send', {2}), ('send', {0, 1, 2}), ('shutdown', {0})],
)
def test_whatever_one_step_raises_the_other_frames_the_join_and_the_close_happen(
    make, error, method, numbers
):
    exchange, far = make(method, numbers, error)
    threads, bus = [*exchange._threads], exchange._bus
    with pytest.raises((exchange_module.CanLinkError, type(error))) as raised:
        exchange.stop()
    assert (bus.calls['send'], bus.calls['shutdown']) == (3, 1)
    assert off_frames(far) == 3 - len(numbers) * (method == 'send')
    assert threads
    assert not any(thread.is_alive() for thread in threads)
    if isinstance(error, Exception) and method == 'send':
        assert f'{len(numbers)} of 3 frames with 0 A' in str(raised.value)
        assert f'({type(error).__name__}: {error})' in str(raised.value)
    else:
        assert raised.value is error
    exchange.stop()  # nothing is left to do
    assert (bus.calls['send'], bus.calls['shutdown']) == (3, 1)


@pytest.mark.parametrize('error', RAISED[:-1], ids=lambda error: type(error).__name__)
def test_a_frame_that_the_bus_does_not_take_ends_neither_the_exchange_nor_its_caller(make, error):
    exchange, far = make('send', {0, 1}, error, threaded=False)
    exchange.watch()
    exchange._steady.now += 20 * MS + 1
    exchange.watch()  # 0 A is due and not taken
    far.send(sample(0))
    assert exchange._attempt(0.0)
    assert not exchange.send_setpoint(exchange.link.latest.stamp, 1.0)
    assert exchange.link.counts.unsent == 2
    assert exchange.unsent_reason == f'{type(error).__name__}: {error}'
    assert exchange.failure == ''
    exchange.stop()
    assert off_frames(far) == 3


def test_what_ends_the_process_while_it_receives_leaves_0_ampere_behind(make):
    exchange, far = make('recv', {0}, KeyboardInterrupt(), threaded=False)
    with pytest.raises(KeyboardInterrupt):
        exchange._attempt(0.0)
    assert off_frames(far) == 3
    assert exchange.failure == 'KeyboardInterrupt: '


def test_a_controller_that_hangs_holds_up_neither_the_watch_nor_its_0_ampere(make):
    answered, hanging = threading.Event(), threading.Event()

    def answer(stamped):
        exchange.send_setpoint(stamped.stamp, 3.0)
        answered.set()
        hanging.wait(LIMIT)

    exchange, far = make(take=answer)
    far.send(sample(0))
    assert answered.wait(LIMIT)
    assert exchange.watch() == pytest.approx(0.020)
    exchange._steady.now += 20 * MS + 1
    assert far.setpoint_where(lambda setpoint: setpoint.answered_counter == 0).current == 3.0
    assert far.setpoint() == Setpoint(0.0, 0, False)
    assert not hanging.is_set()
    hanging.set()
