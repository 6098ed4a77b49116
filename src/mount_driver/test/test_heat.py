"""A coil that is too warm gets less current, smoothly, and the diagnostics say so."""

import itertools
import math

import pytest
from car import MS, Car

from mount_driver.codec import Status
from mount_driver.diagnosis import Past, judge
from mount_driver.parameters import DriverParameters
from mount_driver.snapshot import snapshot
from mount_driver.watches.heat_watch import HeatWatch
from mount_models.coil.heating import CoilHeating
from mount_ros.nodes.diagnostics import Level

QUICK = CoilHeating(time_constant=5.0)  # all of it 120 times as quick, the steps of the current too
S = 1_000_000_000


@pytest.fixture
def car():
    made = Car(heating=QUICK)
    yield made
    made.exchange.stop()
    made.far.close()


def verdict(car):
    now = snapshot(car.exchange, car.now, 0)
    return judge(now, Past(now, now), DriverParameters(heating=QUICK), lockstep=False)


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
    told = (
        'coil above 140 degC by the thermal model: the hotter, the less current it is let, 0 A at 170 degC; '
    )
    assert found.sentence.startswith(told)
    assert found.figures['coil_model_celsius'] == pytest.approx(152.0, abs=1.0)
    assert found.level == Level.WARN
    assert found.figures['derated'] > 10_000


def test_it_gets_its_current_back_when_it_has_cooled(car):
    car.drive(10_000, car.answer)
    assert car.on_bus().current < 2.5
    car.drive(5_000, lambda: car.exchange.send_setpoint(car.stamps[-1], 0.0))
    car.drive(1, car.answer)
    assert car.on_bus().current == 3.0


def heated(measured, sent, seconds):
    watch = HeatWatch(CoilHeating())
    for tick in range(100 * seconds + 1):
        watch.take(tick * 10 * MS, measured, sent)
    return watch


def test_an_hour_of_3_ampere_by_the_shipped_specimen():
    assert heated(3.0, 3.0, 230).current_limit == 3.0
    assert heated(3.0, 3.0, 240).current_limit < 3.0
    assert heated(1.0, 1.0, 3600).current_limit == 3.0


@pytest.mark.parametrize(('measured', 'sent'), [(2.0, 0.0), (0.0, 2.0), (math.nan, 2.0), (-0.1, 2.0)])
def test_the_greater_of_measured_and_sent_current_heats(measured, sent):
    assert heated(measured, sent, 60).celsius == heated(2.0, 2.0, 60).celsius > 85.0


def test_a_reported_temperature_may_raise_the_model_and_never_lower_it():
    watch = heated(1.0, 1.0, 60)
    before = watch.celsius
    for celsius in (-40.0, 20.0, math.nan):
        watch.take_reported(celsius)
    assert watch.celsius == before
    watch.take_reported(155.0)
    assert (watch.celsius, watch.current_limit) == (155.0, 1.5)


def test_a_status_raises_the_model_of_the_driver(car):
    car.drive(100, lambda: car.exchange.send_setpoint(car.stamps[-1], 0.0))
    car.far.send_status(Status(14.0, 155.0))
    car.drive(2, car.answer)
    assert car.on_bus().current == pytest.approx(1.5, abs=0.2)


def test_the_heat_outlives_an_activation_and_a_pause_cools_nothing():
    watch = heated(3.0, 3.0, 200)
    hot = watch.celsius
    watch.begin()  # the stamps of the next activation may be any
    watch.take(3600 * S, 0.0, 0.0)
    assert watch.celsius == hot
    watch.take(7200 * S, 0.0, 0.0)  # an hour without a sample
    assert watch.celsius == hot
    watch.take(7200 * S + S, 0.0, 0.0)
    assert hot - 1.0 < watch.celsius < hot
