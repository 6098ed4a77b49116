"""A ripple that does not fit takes the coil to 0 A on the bus, for good, and the verdict says why."""

import pytest
from far_end import Status, ripple, sample

from mount_driver.health import Health
from mount_driver.parameters import DriverParameters
from mount_ros.nodes.diagnostics import Level

BEFORE = 500  # samples in which all is well


@pytest.fixture
def car(make_car):
    return make_car()


def verdict(car):
    return Health(car.exchange, DriverParameters(), 0, lockstep=False).judge(car.now)


def drive(car, milliseconds, change):
    def electronics(index):
        current = car.on_bus().current if car.sent else 0.0
        slopes = ripple(current)
        values = slopes if index <= BEFORE else {name: change * value for name, value in slopes.items()}
        car.far.send(sample(index, coil_current=current, **values))
        if index % 100 == 0:
            car.far.send_status(Status(14.0, 20.0))

    car.drive(milliseconds, lambda: car.exchange.send_setpoint(car.stamps[-1], 1.0), electronics)


@pytest.mark.parametrize('change', [2.0, 0.5, float('nan')])
def test_the_coil_goes_off_and_stays_off(car, change):
    drive(car, BEFORE, 1.0)
    assert verdict(car).level == Level.OK
    assert verdict(car).figures['ripple_voltage'] == pytest.approx(14.0, abs=0.01)
    drive(car, 330, change)
    found = verdict(car)
    assert found.level == Level.ERROR
    assert found.sentence.startswith('coil switched off: ')
    assert 'ripple' in found.sentence
    assert found.figures['fatal']
    assert car.on_bus().current == 0.0
    assert not car.on_bus().enable
    drive(car, 200, 1.0 if change == change else change)
    assert 300e6 <= car.off_since() - BEFORE * 1e6 <= 330e6
