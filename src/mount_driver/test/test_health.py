"""The verdict says what is wrong, how much, and what to do."""

import re

import pytest
from far_end import CODEC, sample

from mount_driver.clock import ElectronicsClock
from mount_driver.exchange import Exchange
from mount_driver.health import Health
from mount_driver.link import Limits, Refusal
from mount_driver.parameters import DriverParameters
from mount_driver.protocol import Status
from mount_driver.watches.heat_watch import HeatWatch
from mount_ros.nodes.diagnostics import WINDOW, Level

PARAMETERS = DriverParameters(interface='socketcan', channel='can0')
S = 1_000_000_000
BEGIN = 100 * S
NOW = BEGIN + round(WINDOW * S)


def driving(unheard=False):
    """Return an exchange without a bus whose link has taken and answered its first sample at `BEGIN`."""
    heat = HeatWatch(PARAMETERS.heating, 20.0)
    exchange = Exchange(PARAMETERS, CODEC, ElectronicsClock(0), print, heat=heat)
    exchange.link.take(CODEC.encode_measurement(sample(0, setpoint_timeout=unheard), 0), BEGIN)
    exchange.link.answer(BEGIN, 1.0, BEGIN)
    exchange.link.status = Status(13.8, 40.0)
    exchange.last_received = NOW
    return exchange


def verdict(*, lockstep=False, age=0.0, driving_still=True, celsius=20.0, **changes):
    """Return the verdict after 10 s in which counts have risen, or the state of the exchange has changed."""
    exchange = driving()
    link, guard = exchange.link, exchange.guard
    health = Health(exchange, PARAMETERS, BEGIN, lockstep=lockstep)
    link.counts.samples = 9000
    health.judge(BEGIN)
    for name, value in ({'samples': 1000} | changes).items():
        owners = (exchange.reception, link.clock, link.counts, guard, exchange, link)
        owner = next(each for each in owners if hasattr(each, name))
        counting = owner in owners[:3] and isinstance(value, int)
        setattr(owner, name, getattr(owner, name) + value if counting else value)
    guard.heat.take_reported(celsius)
    if not driving_still:
        link.off()
    exchange.last_received = NOW - round(age * S)
    return health.judge(NOW)


def test_a_sound_link_is_ok_with_its_figures():
    sound = verdict()
    assert (sound.level, sound.sentence) == (Level.OK, 'link to the electronics is up')
    assert sound.figures['last_stamp'] == BEGIN
    assert sound.figures['samples'] == 10_000
    assert sound.figures['supply_voltage'] == 13.8


@pytest.mark.parametrize(
    ('changes', 'level', 'sentence'),
    [
        ({'failure': 'gone'}, 2, 'stopped at 0 A: gone'),
        ({'bus_off': True}, 2, 'socketcan can0 is bus off: .* check wiring'),
        ({'age': 0.15}, 2, 'no frames .* more than 100 ms; .*powered, is socketcan can0 up'),
        ({'fault': 'too hot'}, 2, 'switched off: too hot, then activate mount_driver, mount_init'),
        ({'limits': Limits(held='no sensor')}, 2, 'coil at 0 A while this lasts: no sensor'),
        ({'fault': 'too hot', 'refused': 9, 'age': 9.0, 'driving_still': False}, 2, 'too hot'),
        ({'setpoint_errors': 1}, 1, 'damaged, repeated or of wrong sequence; they do not use'),
        ({'status': Status(13.8, 120.1)}, 1, r'120\.1 degC\) is above 120 degC; lower'),
        ({'lost': 2}, 1, r'2 samples lost and 0 frames corrupt .*0\.20 %, limit 0\.1 % of 10 s'),
        ({'corrupt': 5}, 1, '0 samples lost and 5 frames corrupt'),
        ({'invalid_displacements': 3}, 1, 'not valid in 3 samples'),
        ({'gaps': 1}, 1, 'no samples for more than 1 s; check their supply .* activate the graph'),
        ({'celsius': 166.0}, 1, 'above 140 degC by the thermal model: .* 0 A at 170 degC; damp less'),
        ({'repeated': 7, 'wrong_sequence': 1}, 1, '7 frames repeated and 1 of wrong sequence .* not used'),
        ({'unreadable': 2, 'reason': 'TypeError: x'}, 1, r'2 .* not be read .*TypeErr.* another'),
        ({'unsent': 4, 'unsent_reason': 'OSError: full'}, 1, '4 .* not taken .*; OSError: full'),
        ({'refused': 6, 'last_refusal': Refusal.STALE}, 1, '6 setpoints refused.*older than'),
        ({'driving_still': False}, 1, 'no setpoint for 20 ms; is mount_control active'),
        ({'driving_still': False, 'lost': 500}, 1, 'no setpoint for 20 ms.* 500 samples lost'),
        ({'lost': 1, 'age': 0.09, 'status': Status(13.8, 119.9)}, 0, 'is up'),
        ({'age': 100.0, 'lockstep': True}, 0, 'is up'),
    ],
)
def test_a_finding_has_its_level_and_sentence(changes, level, sentence):
    found = verdict(**changes)
    assert found.level == level
    assert re.search(sentence, found.sentence)


@pytest.mark.parametrize('lockstep', [True, False])
def test_a_fault_ends_a_supervised_run_unless_an_initialisation_mends_it(lockstep):
    for changes, flags in (
        ({}, (False, False, False)),
        ({'fault': 'too hot'}, (True, True, False)),
        ({'fault': 'another node', 'foreign_writer': True}, (True, lockstep, False)),
        ({'fault': 'restarted', 'needs_initialisation': True}, (True, False, True)),
    ):
        figures = verdict(lockstep=lockstep, **changes).figures
        assert tuple(figures[name] for name in ('switched_off', 'fatal', 'needs_initialisation')) == flags


def test_setpoints_that_do_not_reach_the_electronics_are_noticed():
    health = Health(driving(unheard=True), PARAMETERS, BEGIN, lockstep=False)
    assert 'do not take the setpoints' not in health.judge(NOW - S).sentence
    assert 'do not take the setpoints' in health.judge(NOW).sentence
