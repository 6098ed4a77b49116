"""On every way out of the exchange 0 A is sent, whatever the bus raises."""

import itertools

import pytest
from far_end import CODEC, FarEnd, sample

from mount_driver import exchange as exchange_module
from mount_driver.can_library import can
from mount_driver.clock import ElectronicsClock
from mount_driver.exchange import Exchange
from mount_driver.parameters import DriverParameters

MS = 1_000_000
_channels = itertools.count()


class Steady:
    """A steady clock that stands until somebody moves it."""

    now = 10**9

    def __call__(self):
        return self.now


RAISED = [can.CanOperationError('no buffer'), OSError('gone'), ValueError('what?'), KeyboardInterrupt()]


class FailingBus:
    """A virtual bus whose calls of `method` with the numbers `failing` raise."""

    def __init__(self, bus, method, failing, error):
        self._bus = bus
        self.calls = dict.fromkeys(('send', 'shutdown'), 0)
        self._method, self._failing, self._error = method, failing, error

    def send(self, message):
        self._count('send')
        self._bus.send(message)

    def shutdown(self):
        self._bus.shutdown()
        self._count('shutdown')

    def __getattr__(self, name):
        return getattr(self._bus, name)

    def _count(self, method):
        number = self.calls[method]
        self.calls[method] += 1
        if method == self._method and number in self._failing:
            raise self._error


@pytest.fixture
def failing(monkeypatch):
    """Return a function that starts an exchange on a bus that fails as told; and bus and far end."""
    genuine, opened = exchange_module.open_bus, []

    def start(method, numbers, error, threaded=True):
        channel = f'test_ways_out_{next(_channels)}'
        far = FarEnd('virtual', channel, 0)
        opened.append(far)

        def opening(*arguments, **options):
            return FailingBus(genuine(*arguments, **options), method, numbers, error)

        monkeypatch.setattr(exchange_module, 'open_bus', opening)
        parameters = DriverParameters(interface='virtual', channel=channel)
        clock = ElectronicsClock(0)
        exchange = Exchange(parameters, CODEC, clock, lambda _: None, steady=Steady())
        exchange.start(threaded=threaded)
        return exchange, exchange._bus, far

    yield start
    for far in opened:
        far.close()


def off_frames(far):
    frames = []
    while (frame := far.bus.recv(0.0)) is not None:
        frames.append(CODEC.decode_setpoint(frame.data)[1])
    assert not any(setpoint.enable for setpoint in frames)
    return len(frames)


@pytest.mark.parametrize('error', RAISED, ids=lambda error: type(error).__name__)
@pytest.mark.parametrize('numbers', [{0}, {1}, {2}, {0, 1, 2}], ids=str)
def test_whatever_one_frame_raises_the_other_frames_the_join_and_the_close_happen(failing, error, numbers):
    exchange, bus, far = failing('send', numbers, error)
    threads = [*exchange._threads]
    with pytest.raises((exchange_module.CanLinkError, KeyboardInterrupt)) as raised:
        exchange.stop()
    assert bus.calls == {'send': 3, 'shutdown': 1}
    assert off_frames(far) == 3 - len(numbers)
    assert threads
    assert not any(thread.is_alive() for thread in threads)
    if isinstance(error, Exception):
        assert f'{len(numbers)} of 3 frames with 0 A' in str(raised.value)
        assert f'({type(error).__name__}: {error})' in str(raised.value)
    else:
        assert raised.value is error
    exchange.stop()  # nothing is left to do
    assert bus.calls == {'send': 3, 'shutdown': 1}


@pytest.mark.parametrize('error', RAISED, ids=lambda error: type(error).__name__)
def test_a_bus_that_does_not_close_well_has_got_0_ampere_and_is_told_of(failing, error):
    exchange, bus, far = failing('shutdown', {0}, error)
    threads = [*exchange._threads]
    with pytest.raises(type(error)):
        exchange.stop()
    assert off_frames(far) == 3
    assert threads
    assert not any(thread.is_alive() for thread in threads)
    exchange.stop()
    assert bus.calls == {'send': 3, 'shutdown': 1}


@pytest.mark.parametrize('error', RAISED[:-1], ids=lambda error: type(error).__name__)
def test_a_frame_that_the_bus_does_not_take_ends_neither_the_exchange_nor_its_caller(failing, error):
    exchange, _, far = failing('send', {0, 1}, error, threaded=False)
    exchange.watch()
    exchange._steady.now += 20 * MS + 1
    exchange.watch()  # 0 A is due and not taken
    far.send(sample(0))
    assert exchange.poll()
    assert not exchange.send_setpoint(exchange.link.latest.stamp, 1.0)
    assert exchange.link.counts.unsent == 2
    assert exchange.unsent_reason == f'{type(error).__name__}: {error}'
    assert exchange.failure == ''
    exchange.stop()
    assert off_frames(far) == 3


def test_what_ends_the_process_while_it_receives_leaves_0_ampere_behind(failing, monkeypatch):
    exchange, bus, far = failing('send', {}, None, threaded=False)

    def interrupted(_):
        raise KeyboardInterrupt

    monkeypatch.setattr(bus, 'recv', interrupted, raising=False)
    far.send(sample(0))
    with pytest.raises(KeyboardInterrupt):
        exchange.poll()
    assert off_frames(far) == 3
    assert exchange.failure == 'KeyboardInterrupt: '
    exchange.stop()
