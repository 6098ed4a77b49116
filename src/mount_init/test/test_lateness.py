"""Setpoints that come late now and then are carried over; lateness and a loose coil are told apart."""

from collections import deque

import pytest

from mount_init.errors import CurrentNotFollowingError, InitialisationError
from mount_init.initialisation import Initialisation
from mount_init.parameters import InitParameters

HOLD = 20  # samples: the setpoint timeout of driver and electronics


class Electronics:
    """Follows each setpoint `delay(number)` samples late; goes to 0 A without one young enough."""

    def __init__(self, plant, delay):
        self.plant, self.late = plant, 0
        self._delay, self._under_way = delay, deque()  # (arrival, answered, A), in order
        self._answered, self._current, self._on = 0, 0.0, True

    def follow(self, setpoint):
        number = self.plant.number
        last = self._under_way[-1][0] if self._under_way else 0
        self._under_way.append((max(last, number + self._delay(number)), number, setpoint))
        while self._under_way and self._under_way[0][0] <= number:
            _, answered, current = self._under_way.popleft()
            if number - answered <= HOLD:
                self._answered, self._current, self._on = answered, current, True
            else:
                self.late += 1
        if number - self._answered > HOLD:
            self.late += self._on
            self._current, self._on = 0.0, False
        self.plant.follow(self._current)


def run(plant, specimen, delay, limit=40_000):
    electronics = Electronics(plant, delay)
    ramp = Initialisation(specimen, InitParameters())
    while not ramp.finished:
        assert plant.number < limit
        electronics.follow(ramp.step((plant.number + 1) * 1_000_000, *plant.sample()))
    return ramp, electronics


def stalled(*spans):
    """Return delays of a machine that stands still in these spans of samples."""
    return lambda number: max((end - number for begin, end in spans if begin <= number < end), default=1)


def now_and_then(number):
    """Return the delay of a machine that stands still for 45 ms every 700 ms, whatever else comes."""
    return stalled((number // 700 * 700 + 600, number // 700 * 700 + 645))(number)


@pytest.mark.parametrize(
    'delay',
    [
        pytest.param(now_and_then, id='now and then'),
        pytest.param(stalled((200, 260)), id='at rest'),
        pytest.param(stalled((1000, 1045)), id='on the way up'),
        pytest.param(stalled((1900, 1945), (1960, 1990)), id='on the way down, and again'),
        pytest.param(stalled((1370, 1470)), id='at the peak'),
        pytest.param(stalled((2600, 2622)), id='at the end'),
        pytest.param(lambda number: 15, id='15 ms all the time'),
    ],
)
def test_setpoints_that_come_late_now_and_then_are_carried_over(simulated_actuator, specimen, delay):
    ramp, electronics = run(simulated_actuator(), specimen, delay)
    assert (ramp.interruptions > 0) == (electronics.late > 0)
    ramp.note_late(electronics.late)
    result, undisturbed = ramp.result(), run(simulated_actuator(), specimen, lambda number: 0)[0].result()
    assert result.rest_gap == pytest.approx(undisturbed.rest_gap, abs=1e-6)
    assert result.contact_gap == pytest.approx(undisturbed.contact_gap, abs=1e-6)


def test_setpoints_that_always_come_late_are_refused_by_their_name(simulated_actuator, specimen):
    ramp, electronics = run(simulated_actuator(), specimen, lambda number: 25)
    with pytest.raises(InitialisationError, match=r'\d+ setpoints came too late .* 20 ms .* overloaded: end'):
        ramp.note_late(electronics.late)


def test_setpoints_that_come_late_too_often_are_refused_by_their_name(simulated_actuator, specimen):
    often = stalled(*((begin, begin + 25) for begin in range(100, 40_000, 100)))
    ramp, electronics = run(simulated_actuator(), specimen, often)
    with pytest.raises(InitialisationError, match='interrupted 41 times, limit 40'):
        ramp.note_late(electronics.late)


def test_a_coil_that_is_open_or_comes_loose_is_named_and_not_the_machine(simulated_actuator, specimen):
    for since in (0, 1000):
        plant = simulated_actuator(distort=lambda n, s, since=since: s if n < since else (0.0, s[1], s[2]))
        ramp, electronics = run(plant, specimen, lambda number: 0)
        assert plant.number < since + 600
        ramp.note_late(electronics.late)
        with pytest.raises(CurrentNotFollowingError, match=r'coil current \(0.000 A\)'):
            ramp.result()


def test_a_loose_contact_does_not_pass_for_a_late_machine(simulated_actuator, specimen):
    plant = simulated_actuator(distort=lambda n, s: (0.0, s[1], s[2]) if 1000 <= n < 1025 else s)
    ramp, electronics = run(plant, specimen, lambda number: 0)
    assert (ramp.interruptions, electronics.late) == (1, 0)
    with pytest.raises(CurrentNotFollowingError, match='no setpoint came too late: check coil, cable'):
        ramp.note_late(electronics.late)
