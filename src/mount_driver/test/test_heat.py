"""A coil that is too warm gets less current, smoothly, and the diagnostics say so."""

import itertools
import math
from types import SimpleNamespace

import numpy as np
import pytest
from car import MS
from far_end import sample

from mount_driver.health import Health
from mount_driver.link import Stamped
from mount_driver.node import MountDriver
from mount_driver.parameters import DriverParameters
from mount_driver.protocol import Setpoint
from mount_driver.watches.heat_watch import HeatWatch
from mount_models.coil.copper import CoilHeating, warmed
from mount_ros.nodes.diagnostics import Level

QUICK = CoilHeating(time_constant=5.0)  # all of it 120 times as quick, the steps of the current too


@pytest.fixture
def car(make_car):
    return make_car(heating=QUICK)


def verdict(car):
    return Health(car.exchange, DriverParameters(heating=QUICK), 0, lockstep=False).judge(car.now)


def test_3_ampere_for_long_are_lowered_smoothly_before_the_limit_and_the_coil_is_not_doubted(car):
    car.drive(1000, car.answer)
    assert {setpoint.current for _, setpoint in car.sent if setpoint.enable} == {3.0}
    assert verdict(car).level == Level.OK
    car.drive(14_000, car.answer)
    currents = [setpoint.current for _, setpoint in car.sent if setpoint.enable]
    assert max(abs(left - right) for left, right in itertools.pairwise(currents)) < 0.3
    heat = car.exchange.guard.heat
    assert QUICK.derating_celsius < heat.celsius < QUICK.limit_celsius
    assert currents[-1] == pytest.approx(heat.current_limit, abs=1e-4)
    assert currents[-1] == pytest.approx(1.78, abs=0.01)
    assert car.exchange.link.fault == ''
    found = verdict(car)
    assert found.level == Level.WARN
    assert found.sentence.startswith('coil above 140 degC by the thermal model: the hotter, the less current')
    assert found.figures['coil_model_celsius'] == pytest.approx(152.0, abs=1.0)


def heated(current, seconds):
    watch = HeatWatch(CoilHeating())
    watch.take_reported(20.0)
    for _ in range(10 * seconds):
        watch.warm(current * current, 0.1)
    return watch


@pytest.mark.parametrize(('measured', 'sent'), [(2.0, 0.0), (0.0, 2.0), (math.nan, 2.0), (-0.1, 2.0)])
def test_the_greater_of_measured_and_sent_current_heats(car, measured, sent):
    guard = car.exchange.guard
    guard.heat.take_reported(20.0)
    for index in range(1001):
        guard.sent.append(Setpoint(sent, index))
        guard.unjudged = Stamped(index * MS, sample(index, coil_current=measured)), index * MS
        guard.judge_sample()
    expected = 80.0
    for _ in range(10):
        expected = warmed(QUICK, expected, 4.0, 0.1)
    assert guard.heat.celsius == pytest.approx(expected, abs=1e-9)


def test_a_reported_temperature_may_raise_the_model_and_never_lower_it():
    watch = heated(1.0, 60)
    before = watch.celsius
    for celsius in (-40.0, 20.0, math.nan):
        watch.take_reported(celsius)
    assert watch.celsius == before
    watch.take_reported(155.0)
    assert (watch.celsius, watch.current_limit) == (155.0, 1.5)  # nothing to spare any more


def test_the_heat_outlives_an_activation_and_a_pause_cools_nothing():
    watch = heated(3.0, 200)
    hot = watch.celsius
    watch.begin()
    assert watch.celsius == hot
    watch.warm(0.0, 3600.0)  # an hour without a sample
    assert watch.celsius == hot
    watch.warm(0.0, 1.0)
    assert hot - 1.0 < watch.celsius < hot


def restarted_driving(watch_of, reported=math.nan, seconds=3600, period=120):
    """Return the highest temperature of a coil that a driver begun anew and anew drives at its limit."""
    heating, true, hottest, watch = CoilHeating(), 80.0, 80.0, None
    for tick in range(10 * seconds):
        if tick % (10 * period) == 0:
            watch = watch_of(watch)
            watch.begin()
        watch.take_reported(true if reported == 'true' else reported)
        current = watch.current_limit
        watch.warm(current * current, 0.1)
        true = warmed(heating, true, current * current, 0.1)
        hottest = max(hottest, true)
    return hottest


def anew(watch):
    return HeatWatch(CoilHeating())


def told(watch):
    return HeatWatch(CoilHeating(), 20.0 if watch is None else watch.celsius)


@pytest.mark.parametrize(
    ('watch_of', 'reported'),
    [(anew, math.nan), (anew, 'true'), (told, math.nan), (told, 20.0), (told, 'true')],
)
def test_a_driver_started_again_every_2_minutes_keeps_the_coil_below_its_limit(watch_of, reported):
    assert restarted_driving(watch_of, reported) < CoilHeating().limit_celsius


def test_a_coil_of_unknown_history_is_derated_until_its_temperature_is_reported_or_the_model_has_cooled():
    watch = HeatWatch(CoilHeating())
    assert watch.celsius == pytest.approx(152.2, abs=0.1)
    for _ in range(5):  # what may be spared, and no more
        watch.take_reported(math.nan)
    for _ in range(30):
        watch.warm(9.0, 0.1)
    assert watch.current_limit == pytest.approx(1.73, abs=0.02)
    assert not watch.known
    watch.take_reported(30.0)
    assert (watch.celsius, watch.current_limit) == (80.0, 3.0)
    watch.take_reported(20.0)
    assert (watch.known, watch.celsius) == (True, 80.0)


def test_a_ramp_fits_into_what_an_activation_has_to_spare_and_a_coil_at_its_limit_is_spared_nothing():
    share = (np.arange(1000) + 0.5) / 1000.0
    rise = 0.2 + 2.8 * share * share * (3.0 - 2.0 * share)
    ramp = [*np.full(350, 0.2), *rise, *np.full(20, 3.0), *rise[::-1], *np.full(350, 0.2)]  # as mount_init's
    watch = HeatWatch(CoilHeating(), 155.0)
    before = watch.celsius
    for current in ramp:
        assert watch.current_limit == 3.0
        watch.warm(current * current, 1e-3)
    assert watch.celsius - before < 1.0
    watch.take_reported(166.0)
    watch.begin()
    assert watch.current_limit == pytest.approx(0.4)


def test_the_node_keeps_the_heat_over_a_new_configuration():
    first = DriverParameters(coil_celsius_before=120.0)
    node = SimpleNamespace(_heat=None)
    node._heat = MountDriver._heat_of(node, first)
    assert node._heat.celsius == pytest.approx(122.4, abs=0.1)
    assert MountDriver._heat_of(node, first) is node._heat
    other = first._replace(heating=CoilHeating(ambient_celsius=60.0))
    assert MountDriver._heat_of(node, other).celsius > 122.0
