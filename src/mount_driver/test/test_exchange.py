"""Frames in, samples out; setpoints in, frames out; and 0 A on every way out."""

import math
import subprocess
import sys
import textwrap

import pytest
from far_end import CODEC, FarEnd, sample
from ros_testing import LIMIT, wait_until

from mount_driver import exchange as exchange_module
from mount_driver.can_library import can
from mount_driver.clock import CounterClock, ElectronicsClock
from mount_driver.exchange import Exchange
from mount_driver.link import Refusal
from mount_driver.parameters import DriverParameters
from mount_driver.protocol import Setpoint, Status

OFF = Setpoint(0.0, 0xFFFF, False)
MS = 1_000_000


class Samples(list):
    """Takes what the exchange hands out."""

    take = list.append

    def wait_for(self, count):
        wait_until(lambda: len(self) >= count, f'{count} samples')


@pytest.fixture
def samples():
    return Samples()


@pytest.fixture
def make(multicast, samples):
    """Return a function that starts an exchange, and returns it with the far end of its bus."""
    group, port = multicast
    opened = []

    def start(*, interface='udp_multicast', lockstep=True, take=samples.take, threaded=True, **parameters):
        channel = group if interface == 'udp_multicast' else f'exchange-{port}'
        chosen = DriverParameters(interface=interface, channel=channel, port=port)._replace(**parameters)
        far = FarEnd(interface, channel, port)
        opened.append(far.close)
        clock = CounterClock() if lockstep else ElectronicsClock(0)
        exchange = Exchange(chosen, CODEC, clock, take)
        exchange.start(threaded=threaded)
        opened.append(exchange.stop)
        return exchange, far

    yield start
    for close in reversed(opened):
        close()


@pytest.mark.parametrize('interface', ['udp_multicast', 'virtual'])
def test_a_sample_is_handed_out_with_its_stamp(make, samples, interface):
    _, far = make(interface=interface)
    far.send(sample(7))
    samples.wait_for(1)
    assert samples == [(7 * MS, sample(7))]


def test_electronics_of_another_rate_take_the_coil_to_0_a_until_the_next_activation(make, samples):
    exchange, far = make(interface='virtual', threaded=False, sample_rate=2000.0)
    for index in range(30):
        far.send(sample(index))
        assert exchange.poll()
        exchange.send_setpoint(index * MS, 1.0)
    assert 'sample every 1000 us, but sample_rate (2000 Hz) means 500 us' in exchange.link.fault
    assert exchange.link.last_refusal is Refusal.SWITCHED_OFF
    setpoints = [far.setpoint() for _ in range(exchange.link.counts.setpoints)]
    assert far.setpoint()._replace(answered_counter=0) == Setpoint(0.0, 0, False)
    assert len(setpoints) < 20


def test_without_a_thread_each_poll_handles_one_frame(make, samples):
    exchange, far = make(interface='virtual', threaded=False)
    assert not exchange.poll()
    far.send(sample(7))
    far.send(sample(8))
    assert exchange.poll()
    assert samples == [(7 * MS, sample(7))]
    assert exchange.poll()
    assert not exchange.poll()
    assert samples == [(7 * MS, sample(7)), (8 * MS, sample(8))]


def test_what_goes_wrong_in_a_poll_ends_the_exchange_at_0_ampere(make):
    def choke(stamped):
        raise RuntimeError('nobody foresaw this')

    exchange, far = make(interface='virtual', threaded=False, take=choke)
    far.send(sample(7))
    assert not exchange.poll()
    assert exchange.failure == 'RuntimeError: nobody foresaw this'
    assert far.setpoint() == OFF
    far.send(sample(8))
    assert not exchange.poll()


def test_a_setpoint_leaves_as_the_answer_to_its_sample(make, samples):
    exchange, far = make()
    for index in range(5):
        far.send(sample(index))
    samples.wait_for(5)
    assert exchange.send_setpoint(3 * MS, 1.25)
    assert far.setpoint() == Setpoint(1.25, 3, True)


def test_a_refused_setpoint_does_not_leave(make, samples):
    exchange, far = make()
    far.send(sample(0))
    samples.wait_for(1)
    assert not exchange.send_setpoint(0, math.nan)
    assert not exchange.send_setpoint(12345, 1.0)
    assert exchange.send_setpoint(0, 0.75)
    assert far.setpoint().current == 0.75


def test_a_corrupt_frame_is_counted_and_not_handed_out(make, samples):
    exchange, far = make()
    far.send(sample(0), damage=0x10)
    far.send(sample(1))
    samples.wait_for(1)
    assert [measurement.sample_counter for _, measurement in samples] == [1]
    assert exchange.link.counts.corrupt == 1


@pytest.mark.parametrize('interface', ['udp_multicast', 'virtual'])
@pytest.mark.parametrize(
    'odd',
    [
        {'data': bytes(8)},
        {'data': bytes(64), 'dlc': 64},
        {'data': b'', 'is_fd': False},
        {'data': b'', 'is_fd': False, 'is_remote_frame': True, 'dlc': 8},
        {'data': bytes(24), 'is_extended_id': True},
        {'data': bytes(8), 'is_fd': False, 'is_error_frame': True},
    ],
    ids=['short', 'long', 'empty', 'remote', 'extended', 'error'],
)
def test_a_frame_of_another_form_costs_itself_alone(make, samples, interface, odd):
    exchange, far = make(interface=interface)
    far.send_raw(CODEC.measurement.frame_id, **odd)
    far.send(sample(1))
    samples.wait_for(1)
    assert [measurement.sample_counter for _, measurement in samples] == [1]
    assert exchange.failure == exchange.trouble == ''
    assert exchange.link.counts.recoveries == 0


def test_what_python_can_cannot_read_costs_itself_alone(make, samples):
    exchange, far = make()
    far.bus._sender.sendto(b'\x93\x01\x02\x03', far.bus._destination)
    far.send(sample(1))
    samples.wait_for(1)
    assert exchange.reception.unreadable == 1
    assert exchange.failure == ''


def test_a_status_is_kept(make):
    exchange, far = make()
    far.send_status(Status(13.5, 41.0, over_current=True))
    wait_until(lambda: exchange.link.status is not None, 'a status')
    assert exchange.link.status.over_current


def test_when_setpoints_stop_0_ampere_is_sent_while_samples_go_on(make, samples):
    exchange, far = make(lockstep=False)
    far.stream()
    samples.wait_for(1)
    wait_until(lambda: exchange.send_setpoint(samples[-1][0], 0.05), 'a setpoint in time')
    answered = far.setpoint_where(lambda setpoint: setpoint.enable)
    assert answered.current == 0.05
    off = far.setpoint_where(lambda setpoint: not setpoint.enable)
    assert (off.current, off.answered_counter) == (0.0, answered.answered_counter)
    assert exchange.link.counts.setpoint_timeouts == 1


def test_when_setpoints_and_samples_stop_0_ampere_is_sent(make, samples):
    exchange, far = make(lockstep=False)
    far.send(sample(0))
    samples.wait_for(1)
    exchange.send_setpoint(samples[0][0], 2.0)
    assert far.setpoint_where(lambda setpoint: setpoint.enable).current == 2.0
    assert far.setpoint_where(lambda setpoint: not setpoint.enable).current == 0.0


def test_in_lock_step_the_wall_clock_switches_nothing_off(make, samples):
    exchange, far = make()
    assert far.nothing_for(0.05)
    far.send(sample(0))
    samples.wait_for(1)
    exchange.send_setpoint(0, 2.0)
    assert far.setpoint().enable
    assert far.nothing_for(0.1)  # five times the timeout


def test_in_lock_step_the_stamps_switch_off(make, samples):
    exchange, far = make()
    assert far.nothing_for(0.03)  # time begins with the first sample, not before
    far.send(sample(100))
    samples.wait_for(1)
    exchange.send_setpoint(100 * MS, 2.0)
    assert far.setpoint().enable
    far.send(sample(120))
    samples.wait_for(2)
    assert far.nothing_for(0.02)
    far.send(sample(121))
    assert far.setpoint() == Setpoint(0.0, 100, False)


def test_a_sample_sent_again_gets_its_answer_again(make, samples):
    exchange, far = make()
    far.send(sample(5))
    samples.wait_for(1)
    exchange.send_setpoint(5 * MS, 1.5)
    first = far.bus.recv(LIMIT)
    far.send(sample(5))
    again = far.bus.recv(LIMIT)
    assert (
        CODEC.decode_setpoint(again.data)[1] == CODEC.decode_setpoint(first.data)[1] == Setpoint(1.5, 5, True)
    )
    assert again.data[2] == first.data[2] + 1  # a frame of its own by its alive counter
    assert len(samples) == 1


def test_a_sample_sent_again_before_its_answer_is_counted_alone(make, samples):
    exchange, far = make()
    far.send(sample(5))
    far.send(sample(5))
    wait_until(lambda: exchange.link.counts.resent == 1, 'the second frame')
    exchange.send_setpoint(5 * MS, 1.5)
    assert far.setpoint() == Setpoint(1.5, 5, True)
    assert far.nothing_for(0.02)
    assert len(samples) == 1


def test_stopping_sends_0_ampere_several_times_and_nothing_after(make, samples):
    exchange, far = make()
    far.send(sample(9))
    samples.wait_for(1)
    exchange.send_setpoint(9 * MS, 2.0)
    exchange.stop()
    assert not exchange.send_setpoint(9 * MS, 2.0)
    frames = [far.setpoint() for _ in range(4)]
    assert frames == [Setpoint(2.0, 9, True)] + [Setpoint(0.0, 9, False)] * 3
    assert far.nothing_for(0.0)


def test_stopping_twice_does_nothing(make):
    exchange, far = make()
    exchange.stop()
    exchange.stop()
    assert [far.setpoint() for _ in range(3)] == [OFF] * 3
    assert far.nothing_for(0.0)


def test_an_error_in_the_receiving_thread_sends_0_ampere_and_is_kept(make):
    def fail(stamped):
        raise RuntimeError('the middleware is gone')

    exchange, far = make(take=fail)
    far.send(sample(0))
    assert far.setpoint() == OFF
    wait_until(lambda: exchange.failure, 'a failure')
    assert exchange.failure == 'RuntimeError: the middleware is gone'
    assert not exchange.send_setpoint(0, 1.0)


def test_bus_off_drops_setpoints_until_a_sample_comes_again(make, samples):
    exchange, far = make()
    far.send(sample(0))
    far.send_raw(0x40, bytes(8), is_error_frame=True, is_fd=False)
    wait_until(lambda: exchange.bus_off, 'bus off')
    assert not exchange.send_setpoint(0, 1.0)
    assert exchange.link.last_refusal is Refusal.BUS_LOST
    far.send(sample(1))
    samples.wait_for(2)
    assert exchange.send_setpoint(1 * MS, 1.0)
    assert far.setpoint().current == 1.0
    assert exchange.link.counts.error_frames == 1


class BreakingBus:
    """A bus whose next reception fails, and its end too."""

    def __init__(self, bus):
        self._bus = bus

    def recv(self, timeout):
        raise can.CanOperationError('network is down')

    def shutdown(self):
        self._bus.shutdown()
        raise OSError('bad file descriptor')

    def __getattr__(self, name):
        return getattr(self._bus, name)


def break_bus(monkeypatch, failures):
    """Let the first bus break when it receives; then `failures` attempts to open it again fail."""
    genuine, calls = exchange_module.open_bus, []

    def opening(*arguments, **options):
        calls.append(arguments)
        if len(calls) == 1:
            return BreakingBus(genuine(*arguments, **options))
        if len(calls) <= 1 + failures:
            raise exchange_module.CanLinkError('still down')
        return genuine(*arguments, **options)

    monkeypatch.setattr(exchange_module, 'open_bus', opening)
    monkeypatch.setattr(exchange_module, '_REOPEN_PERIOD', 0.001)


def test_a_lost_bus_is_opened_again(make, samples, monkeypatch):
    break_bus(monkeypatch, failures=3)
    exchange, far = make()
    wait_until(lambda: exchange.link.counts.recoveries == 1, 'recovery')
    far.send(sample(0))
    samples.wait_for(1)
    assert exchange.send_setpoint(0, 1.0)
    assert far.setpoint().current == 1.0
    assert exchange.trouble == exchange.failure == ''


def test_a_bus_that_stays_lost_is_given_up_with_a_sentence(make, monkeypatch):
    break_bus(monkeypatch, failures=10**9)
    exchange, _ = make(recovery_time=0.01)
    wait_until(lambda: exchange.failure, 'giving up')
    assert exchange.failure.startswith('still down; given up after 0.01 s')
    assert not exchange.send_setpoint(0, 1.0)
    assert exchange.link.last_refusal is Refusal.BUS_LOST


def test_a_bus_that_does_not_take_frames_is_counted(make, samples, monkeypatch):
    exchange, far = make()
    far.send(sample(0))
    samples.wait_for(1)

    def refuse(message, timeout=None):
        raise can.CanOperationError('Transmit buffer full')

    monkeypatch.setattr(exchange._bus, 'send', refuse)
    assert not exchange.send_setpoint(0, 1.0)
    assert exchange.link.counts.unsent == 1
    assert exchange.unsent_reason == 'CanOperationError: Transmit buffer full'
    with pytest.raises(exchange_module.CanLinkError, match=r'3 of 3 frames with 0 A .* \(.*buffer full\)'):
        exchange.stop()


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
    ended = subprocess.run(
        [sys.executable, '-c', textwrap.dedent(program)], capture_output=True, timeout=60, check=False
    )
    assert b'SystemError: crash' in ended.stderr
    assert far.setpoint() == OFF
    far.close()
