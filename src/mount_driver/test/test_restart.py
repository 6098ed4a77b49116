"""Behind a restart of the electronics the coil stays at 0 A until a new activation."""

import re

import pytest
from car import GOOD, MS
from far_end import sample

from mount_driver.link import Refusal
from mount_driver.protocol import AliveCounter, Status


def restarted(car, pause):
    """Return electronics that are silent for `pause` ms, then count from 0 again."""
    car.far._measurement_alive = AliveCounter()

    def electronics(index):
        k = index - GOOD - 1 - pause
        if k >= 0:
            car.far.send(sample(k, coil_current=car.on_bus().current))

    return electronics


@pytest.mark.parametrize('pause', [0, 5, 30, 500])
def test_a_restart_gives_0_ampere_for_good_and_needs_nothing_but_an_initialisation(car, pause):
    car.drive(900, car.answer, electronics=restarted(car, pause))
    link = car.exchange.link
    assert car.off_since() <= GOOD * MS + min(pause + 4, 21) * MS
    assert link.last_refusal is Refusal.SWITCHED_OFF
    assert link.needs_initialisation
    told = r"the electronics' counters .* begun anew, as at a restart \(1 times, limit 0\): check their"
    assert re.match(told, link.fault)
    assert (link.clock.restarts, link.counts.jumps, link.counts.lost) == (1, 0, 0)


@pytest.mark.parametrize(
    ('number', 'microseconds'),
    [
        (1, 0),  # the clock stands still
        (300, 1000),  # the counter of samples jumps
    ],
)
def test_counters_that_contradict_each_other_do_so_too(car, number, microseconds):
    told = sample(GOOD, coil_current=3.0)._replace(
        sample_counter=GOOD + number, microseconds=GOOD * 1000 + microseconds
    )
    car.drive(1, car.answer, electronics=lambda index: car.far.send(told))
    assert car.off_since() == GOOD * MS + MS
    assert "the electronics' counters contradict each other" in car.exchange.link.fault
    assert car.exchange.link.needs_initialisation


@pytest.mark.parametrize('missing', [1, 40, 400])
def test_lost_samples_are_no_jump(car, missing):
    car.drive(missing, lambda: None, electronics=lambda index: None)
    car.drive(10, car.answer)
    assert car.exchange.link.counts.jumps == 0
    assert car.exchange.link.fault == ''


def test_a_graver_fault_takes_the_place_of_a_restart_and_not_the_other_way_round(car):
    car.drive(50, car.answer, electronics=restarted(car, 0))
    assert car.exchange.link.needs_initialisation
    car.far._status_alive = AliveCounter()
    for _ in range(5):  # from the fourth on it is believed
        car.far.send_status(Status(5.0, 20.0))
    car.drive(1, car.answer, electronics=lambda index: None)
    assert 'supply voltage (5.00 V)' in car.exchange.link.fault
    assert not car.exchange.link.needs_initialisation
    car.drive(900, car.answer, electronics=restarted(car, 0))
    assert 'supply voltage (5.00 V)' in car.exchange.link.fault
