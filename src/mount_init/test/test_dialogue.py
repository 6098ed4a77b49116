"""Each sample is answered at most once, nobody else is disturbed, and the end is 0 A."""

import math
import threading

import pytest

from mount_init.dialogue import CoilDialogue
from mount_init.errors import InitialisationError
from mount_init.initialisation import Initialisation
from mount_init.parameters import InitParameters

LONG = 10.0  # s: a limit that is never reached
STEP = 1_000_000  # ns


class Bench:
    """A dialogue with a coil that follows its setpoints exactly; the ramp runs in a thread of its own."""

    def __init__(self, specimen):
        self.setpoints = []
        self.dialogue = CoilDialogue(lambda stamp, current: self.setpoints.append((stamp, current)))
        self.ramp = Initialisation(specimen, InitParameters(sample_rate=100.0))
        self.ending = threading.Event()
        self.outcome = None
        self._thread = None

    def start(self, silence=LONG, total=math.inf):
        begun = threading.Event()
        begin = self.dialogue._begin

        def begin_and_tell(ramp):
            begin(ramp)
            begun.set()

        def run():
            try:
                self.dialogue.run(self.ramp, silence, total, self.ending)
            except InitialisationError as error:
                self.outcome = error

        self.dialogue._begin = begin_and_tell
        self._thread = threading.Thread(target=run)
        self._thread.start()
        assert begun.wait(LONG)

    def join(self):
        self._thread.join(LONG)
        assert not self._thread.is_alive()
        return self.outcome

    def sample(self, number):
        """Deliver the sample of this number, with the current of the last setpoint."""
        current = self.setpoints[-1][1] if self.setpoints else 0.0
        self.dialogue.take_ripple(number * STEP, current, 300.0, 100.0)

    def echo(self):
        """Deliver the last setpoint as it comes back from the topic."""
        self.dialogue.take_setpoint(*self.setpoints[-1])


@pytest.fixture
def bench(specimen):
    return Bench(specimen)


def test_every_sample_of_the_ramp_is_answered_once_with_its_own_stamp(bench):
    bench.start()
    for number in range(1, bench.ramp.length + 1):
        bench.sample(number)
        bench.echo()
    assert bench.join() is None
    assert [stamp for stamp, _ in bench.setpoints] == [n * STEP for n in range(1, bench.ramp.length + 1)]
    assert [current for _, current in bench.setpoints] == bench.ramp.ramp.setpoints.tolist()
    assert bench.ramp.last_stamp == bench.ramp.length * STEP


def test_without_a_ramp_nothing_is_answered(bench):
    for number in range(1, 10):
        bench.sample(number)
    bench.dialogue.switch_off()
    assert bench.setpoints == []


def test_a_waiting_sample_is_answered_first(bench):
    bench.sample(6)
    bench.sample(7)
    bench.start()
    assert [stamp for stamp, _ in bench.setpoints] == [7 * STEP]
    bench.sample(8)
    assert [stamp for stamp, _ in bench.setpoints] == [7 * STEP, 8 * STEP]
    bench.ending.set()
    bench.join()


def test_a_waiting_sample_that_another_node_has_answered_is_left_alone(bench):
    bench.sample(7)
    bench.dialogue.take_setpoint(7 * STEP, 0.0)
    bench.start()
    assert bench.setpoints == []
    bench.sample(8)
    assert [stamp for stamp, _ in bench.setpoints] == [8 * STEP]
    bench.ending.set()
    bench.join()


def test_a_waiting_sample_newer_than_the_last_answer_of_others_is_answered(bench):
    bench.dialogue.take_setpoint(6 * STEP, 0.0)
    bench.sample(7)
    bench.start()
    assert [stamp for stamp, _ in bench.setpoints] == [7 * STEP]
    bench.ending.set()
    bench.join()


def test_the_last_sample_of_one_ramp_is_not_answered_again_by_the_next(bench, specimen):
    bench.start()
    for number in range(1, bench.ramp.length + 1):
        bench.sample(number)
        bench.echo()
    bench.join()
    count = len(bench.setpoints)
    bench.ramp = Initialisation(specimen, InitParameters(sample_rate=100.0))
    bench.start()
    assert len(bench.setpoints) == count
    bench.sample(bench.ramp.length + 1)
    assert len(bench.setpoints) == count + 1
    bench.ending.set()
    bench.join()


def test_repeated_and_late_samples_are_not_answered(bench):
    bench.start()
    for number in (1, 2, 2, 1, 3):
        bench.sample(number)
    assert [stamp // STEP for stamp, _ in bench.setpoints] == [1, 2, 3]
    assert bench.ramp.readings.received == 3
    bench.ending.set()
    bench.join()


def test_electronics_that_start_anew_are_answered(bench):
    bench.sample(1000)
    bench.dialogue.take_setpoint(1000 * STEP, 0.0)
    bench.sample(1)
    bench.start()
    assert [stamp // STEP for stamp, _ in bench.setpoints] == [1]
    bench.ending.set()
    bench.join()


def test_silence_ends_the_ramp_with_zero_current(bench):
    bench.start(silence=0.1)
    for number in range(1, 38):
        bench.sample(number)
    error = bench.join()
    assert isinstance(error, InitialisationError)
    assert '37 of 275 ripple samples, none in the last 0.1 s; is mount_driver active?' in str(error)
    assert bench.setpoints[-2][1] > 0.0
    assert bench.setpoints[-1] == (37 * STEP, 0.0)


def test_a_ramp_that_takes_too_long_is_given_up(bench):
    bench.start(total=0.1)
    number = 0
    while bench._thread.is_alive() and number < 200:
        number += 1
        bench.sample(number)
        bench._thread.join(0.005)
    assert 'of 275 ripple samples in 0.1 s' in str(bench.join())
    assert bench.setpoints[-1][1] == 0.0


def test_the_end_of_the_process_ends_the_ramp_with_zero_current(bench):
    bench.start()
    for number in range(1, 100):
        bench.sample(number)
    bench.ending.set()
    assert 'the process is ending' in str(bench.join())
    assert bench.setpoints[-2][1] > 0.0
    assert bench.setpoints[-1] == (99 * STEP, 0.0)


def test_a_setpoint_of_another_node_ends_the_ramp_with_zero_current(bench):
    bench.start()
    for number in range(1, 100):
        bench.sample(number)
        bench.echo()
    bench.dialogue.take_setpoint(99 * STEP, 1.234)
    error = bench.join()
    assert isinstance(error, InitialisationError)
    assert '1.234 A during the ramp; deactivate mount_control' in str(error)
    assert bench.setpoints[-1] == (99 * STEP, 0.0)


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
    assert [stamp // STEP for stamp, _ in bench.setpoints] == [2]
    bench.ending.set()
    bench.join()


def test_own_setpoints_do_not_count_as_those_of_others(bench):
    bench.start()
    for number in range(1, bench.ramp.length + 1):
        bench.sample(number)
        bench.echo()
    assert bench.join() is None
    bench.ending.set()  # a wait would end at once, and the second look would refuse
    bench.dialogue.await_quiet(100.0, bench.ending)
