"""What the simulated vehicle sends of its engine, and what arrives."""

import math

import pytest

from mount_driver.can_library import cantools
from mount_sim.electronics.vehicle_bus import READ_BY_DRIVER, received_velocity, sent_every, speed_frame


def test_the_speed_arrives_in_steps_of_a_quarter_turn_a_minute():
    database = cantools.database.load_file(READ_BY_DRIVER['engine_speed.dbc'])
    (signal,) = database.get_message_by_name('EngineData').signals
    assert (signal.unit, signal.scale) == ('rpm', 0.25)
    for ignitions, rpm in ((26.7, 801.0), (26.71, 801.25), (5.0, 150.0), (200.0, 6000.0)):
        assert received_velocity(ignitions) == pytest.approx(rpm * math.pi / 30.0, rel=1e-15)
        decoded = database.decode_message('EngineData', speed_frame(ignitions).data)
        assert decoded == {'EngineSpeed': rpm}


@pytest.mark.parametrize(('rate', 'samples'), [(500.0, 5), (1000.0, 10), (2000.0, 20)])
def test_it_is_sent_every_10_ms(rate, samples):
    assert sent_every(rate) == samples
