"""Each sample is answered at most once, nobody else is disturbed, and the end is 0 A."""

import threading
import time

import pytest
from simulated_actuator import SPECIMEN

from mount_init.dialogue import CoilDialogue, DriverReport
from mount_init.errors import InitialisationError
from mount_init.initialisation import Initialisation
from mount_init.parameters import InitParameters

LONG = 10.0  # s: a limit that is never reached
STEP = 1_000_000  # ns


class Bench:
    """A dialogue with a coil that follows its setpoints exactly; the ramp runs in a thread of its own."""

    def __init__(self):
        self.setpoints = []
        self.dialogue = CoilDialogue(lambda stamp, current: self.setpoints.append((stamp, current)))
        self.ending = threading.Event()
        self.outcome = None
        self.thread = None

    @property
    def numbers(self):
        """The numbers of the samples that were answered."""
        return [stamp // STEP for stamp, _ in self.setpoints]

    def start(self, silence_timeout=LONG, total_timeout=LONG):
        parameters = InitParameters(100.0, silence_timeout=silence_timeout, total_timeout=total_timeout)
        self.ramp = Initialisation(SPECIMEN, parameters)
        begun = threading.Event()
        begin = self.dialogue._begin

        def begin_and_tell(ramp):
            begin(ramp)
            begun.set()

        def run():
            try:
                self.dialogue.run(self.ramp, self.ending)
            except InitialisationError as error:
                self.outcome = str(error)

        self.dialogue._begin = begin_and_tell
        self.thread = threading.Thread(target=run)
        self.thread.start()
        assert begun.wait(LONG)

    def join(self):
        self.thread.join(LONG)
        assert not self.thread.is_alive()
        return self.outcome

    def sample(self, *numbers, echo=False):
        """Deliver the samples of these numbers, each with the current of the last setpoint."""
        for number in numbers:
            current = self.setpoints[-1][1] if self.setpoints else 0.0
            self.dialogue.take_ripple(number * STEP, current, 300.0, 100.0)
            if echo:  # the setpoint, as it comes back from the topic
                self.dialogue.take_setpoint(*self.setpoints[-1])


@pytest.fixture
def bench():
    made = Bench()
    yield made
    made.ending.set()
    if made.thread:
        made.join()


def test_every_sample_of_the_ramp_is_answered_once_with_its_own_stamp(bench):
    bench.start()
    ramp = range(1, bench.ramp.length + 1)
    bench.sample(*ramp, echo=True)
    assert bench.join() is None
    assert bench.numbers == [*ramp]
    assert [current for _, current in bench.setpoints] == bench.ramp.ramp.setpoints.tolist()
    bench.sample(bench.ramp.length + 1)  # no ramp runs
    bench.ending.set()  # a wait would end at once, and the second look would refuse
    bench.dialogue.await_quiet(100.0, bench.ending)  # its own setpoints are not those of others
    bench.ending.clear()
    bench.start()
    assert bench.numbers == [*ramp, bench.ramp.length + 1]


@pytest.mark.parametrize(
    ('samples', 'foreign', 'answered'),
    [
        ((6, 7), None, [7, 8]),  # one waits
        ((7,), 7, [8]),  # another node has answered it
        ((7,), 6, [7, 8]),
        ((1000, 1), None, [1, 8]),  # the electronics began anew
    ],
)
def test_the_newest_sample_that_nobody_has_answered_is_answered_first(bench, samples, foreign, answered):
    bench.sample(*samples)
    if foreign is not None:
        bench.dialogue.take_setpoint(foreign * STEP, 0.0)
    assert bench.setpoints == []
    bench.start()
    bench.sample(8)
    assert bench.numbers == answered


def test_the_last_sample_of_one_ramp_is_not_answered_again_by_the_next(bench):
    bench.start()
    bench.sample(*range(1, bench.ramp.length + 1))
    bench.join()
    bench.start()
    bench.sample(bench.ramp.length, bench.ramp.length + 1)
    assert bench.numbers == [*range(1, bench.ramp.length + 2)]


def test_repeated_and_late_samples_are_not_answered(bench):
    bench.start()
    bench.sample(1, 2, 2, 1, 3)
    assert bench.numbers == [1, 2, 3]
    assert bench.ramp.readings.received == 3


@pytest.mark.parametrize(
    ('end', 'sentence'),
    [
        (lambda bench: None, '99 of 275 ripple samples, none in the last 0.1 s; is mount_driver active?'),
        (lambda bench: bench.ending.set(), 'the process is ending'),
        (
            lambda bench: bench.dialogue.take_setpoint(99 * STEP, 1.234),
            '1.234 A during the ramp; deactivate mount_control',
        ),
        (lambda bench: bench.dialogue.give_way('another node publishes'), 'another node publishes'),
    ],
)
def test_whatever_ends_a_ramp_ends_it_at_0_ampere_with_its_reason(bench, end, sentence):
    bench.start(silence_timeout=0.1)
    bench.sample(*range(1, 100), echo=True)
    assert bench.setpoints[-1][1] > 0.0
    end(bench)
    assert sentence in bench.join()
    assert bench.setpoints[-1] == (99 * STEP, 0.0)


@pytest.mark.parametrize(
    ('step', 'timeouts', 'sentence'),
    [
        (0, {'silence_timeout': 0.1}, '1 of 275 ripple samples, none in the last 0.1 s'),  # it only repeats
        (1, {'total_timeout': 0.1}, 'of 275 ripple samples in 0.1 s'),
    ],
)
def test_samples_that_repeat_or_come_too_slowly_end_the_ramp(bench, step, timeouts, sentence):
    bench.start(**timeouts)
    for number in range(200):  # 1 s
        bench.sample(1 + step * number)
        bench.thread.join(0.005)
    assert not bench.thread.is_alive()
    assert sentence in bench.join()
    assert bench.setpoints[-1][1] < 0.01


def test_a_late_setpoint_of_another_node_for_a_sample_before_the_ramp_ends_no_ramp(bench):
    bench.start()
    bench.sample(10)
    bench.dialogue.take_setpoint(9 * STEP, 0.0)
    bench.sample(*range(11, 10 + bench.ramp.length))
    assert bench.join() is None


def test_setpoints_of_others_within_the_quiet_time_are_refused(bench):
    stop = threading.Event()

    def drive():
        while not stop.wait(0.005):
            bench.dialogue.take_setpoint(5 * STEP, 0.5)

    bench.dialogue.take_setpoint(5 * STEP, 0.5)
    other = threading.Thread(target=drive)
    other.start()
    with pytest.raises(InitialisationError, match='100 ms without any; deactivate mount_control first'):
        bench.dialogue.await_quiet(0.1, bench.ending)
    stop.set()
    other.join()
    bench.dialogue.await_quiet(0.1, bench.ending)  # it has just fallen silent


def test_after_a_time_without_listening_it_is_waited_for_quiet_and_no_old_sample_is_answered(bench):
    bench.sample(1)
    bench.dialogue.forget_streams()
    bench.ending.set()  # a wait ends at once
    with pytest.raises(InitialisationError):
        bench.dialogue.await_quiet(100.0, bench.ending)
    bench.ending.clear()
    bench.dialogue.await_quiet(0.02, bench.ending)
    bench.start()
    bench.sample(2)
    assert bench.numbers == [2]


@pytest.mark.parametrize(
    ('refuses', 'limit', 'reason'),
    [
        (False, 3.0, ''),
        (True, 3.0, 'mount_driver keeps the coil at 0 A: why'),
        (False, 0.4, 'mount_driver lets the coil carry 0.400 A, the ramp needs 3.000 A: why'),
    ],
)
def test_the_reason_of_the_driver_counts_for_two_seconds(monkeypatch, refuses, limit, reason):
    driver, ending, now = DriverReport(3.0), threading.Event(), time.monotonic()
    ending.set()
    driver.take(refuses, 'why', {'current_limit': str(limit)})
    assert driver.refusal(ending) == reason
    monkeypatch.setattr(time, 'monotonic', lambda: now + 3.0)
    assert driver.refusal(ending) == ''
