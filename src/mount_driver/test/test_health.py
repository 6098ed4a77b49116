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
from mount_ros.nodes.diagnostics import WINDOW, ActiveFindings, Level

PARAMETERS = DriverParameters(interface='socketcan', channel='can0', coil_celsius_before=20.0)
MS, S = 1_000_000, 1_000_000_000
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


def change(exchange, changes):
    """Let an exchange have counted more, or be in another state."""
    link = exchange.link
    for name, value in changes.items():
        counting = next((c for c in (exchange.reception, link.clock, link.counts) if hasattr(c, name)), None)
        if name == 'driving':
            link.off()
        elif name == 'strangers':
            exchange.guard.judge_foreign(None, value)
        elif name == 'celsius':
            exchange.guard.heat.take_reported(value)
        elif counting is not None and isinstance(value, int):
            setattr(counting, name, getattr(counting, name) + value)
        else:
            owners = (counting, exchange.guard, exchange, link)
            setattr(next(owner for owner in owners if hasattr(owner, name)), name, value)


def verdict(*, lockstep=False, age=0.0, **changes):
    exchange = driving()
    health = Health(exchange, PARAMETERS, BEGIN, lockstep=lockstep)
    exchange.link.counts.samples = 9000
    health.judge(BEGIN)
    change(exchange, {'samples': 1000} | changes)
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
        ({'failure': 'gone'}, Level.ERROR, 'stopped at 0 A: gone'),
        ({'trouble': 'network down'}, Level.ERROR, 'CAN bus lost: network down; setpoints are dropped'),
        ({'bus_off': True}, Level.ERROR, 'socketcan can0 is bus off'),
        ({'age': 0.15}, Level.ERROR, 'no frames .* more than 100 ms; .*powered, is socketcan can0 up'),
        (
            {'fault': 'too hot'},
            Level.ERROR,
            'switched off: too hot, then activate mount_driver, mount_init',
        ),
        ({'limits': Limits(held='no sensor')}, Level.ERROR, 'coil at 0 A while this lasts: no sensor'),
        ({'fault': 'too hot', 'refused': 9, 'age': 9.0, 'driving': False}, Level.ERROR, 'too hot'),
        ({'setpoint_errors': 1}, Level.WARN, 'damaged, repeated or of wrong sequence; they do not use'),
        ({'status': Status(13.8, 120.1)}, Level.WARN, r'120\.1 degC\) is above 120 degC; lower'),
        ({'lost': 2}, Level.WARN, r'2 samples lost and 0 frames corrupt .*0\.20 %, limit 0\.1 % of 10 s'),
        ({'corrupt': 5}, Level.WARN, '0 samples lost and 5 frames corrupt'),
        ({'invalid_displacements': 3}, Level.WARN, 'not valid in 3 samples'),
        ({'gaps': 1}, Level.WARN, 'no samples for more than 1 s; check their supply .* activate the graph'),
        (
            {'fault': 'x', 'strangers': NOW - S // 10},
            Level.ERROR,
            'x, then .* again; it still sends',
        ),
        (
            {'fault': 'x', 'strangers': NOW - 9 * S},
            Level.ERROR,
            'again; silent for more than 1 s',
        ),
        (
            {'celsius': 166.0},
            Level.WARN,
            'above 140 degC by the thermal model: .* 0 A at 170 degC; damp less',
        ),
        ({'repeated': 7}, Level.WARN, '7 frames repeated and 0 of wrong sequence'),
        ({'wrong_sequence': 1}, Level.WARN, '1 of wrong sequence .* not used; did the electronics restart'),
        (
            {'unreadable': 2, 'reason': 'TypeError: x'},
            Level.WARN,
            r'2 .* not be read .*TypeErr.* another',
        ),
        ({'unsent': 4, 'unsent_reason': 'OSError: full'}, Level.WARN, '4 .* not taken .*; OSError: full'),
        ({'refused': 6, 'last_refusal': Refusal.STALE}, Level.WARN, '6 setpoints refused.*older than'),
        ({'driving': False}, Level.WARN, 'no setpoint for 20 ms; is mount_control active'),
        ({'limited': 2}, Level.WARN, '2 setpoints limited to 3 A'),
    ],
)
def test_a_finding_has_its_level_and_sentence(changes, level, sentence):
    found = verdict(**changes)
    assert found.level == level
    assert re.search(sentence, found.sentence)


@pytest.mark.parametrize('changes', [{'lost': 1}, {'age': 0.09}, {'status': Status(13.8, 119.9)}])
def test_what_lies_within_the_limits_is_ok(changes):
    assert verdict(**changes).level == Level.OK


@pytest.mark.parametrize('lockstep', [True, False])
def test_a_fault_of_the_coil_ends_a_supervised_run(lockstep):
    figures = verdict(fault='too hot', lockstep=lockstep).figures
    assert (figures['switched_off'], figures['fatal']) == (True, True)
    assert not verdict(lockstep=True).figures['fatal']


def test_a_fault_that_an_initialisation_alone_mends_says_so_and_ends_nothing():
    figures = verdict(fault='restarted', needs_initialisation=True).figures
    assert (figures['switched_off'], figures['fatal'], figures['needs_initialisation']) == (True, False, True)
    for figures in (verdict().figures, verdict(fault='too hot').figures):
        assert not figures['needs_initialisation']


def test_setpoints_that_do_not_reach_the_electronics_are_noticed():
    health = Health(driving(unheard=True), PARAMETERS, BEGIN, lockstep=False)
    assert 'do not take the setpoints' not in health.judge(NOW - S).sentence
    assert 'do not take the setpoints' in health.judge(NOW).sentence


def test_in_lock_step_waiting_is_no_fault():
    assert verdict(age=100.0, lockstep=True).level == Level.OK


def test_before_the_first_setpoint_0_ampere_is_no_fault():
    assert verdict(setpoints=-1, driving=False).level == Level.OK


COUNTS = (
    {'lost': 3000},
    {'invalid_displacements': 1},
    {'repeated': 5},
    {'unreadable': 2, 'reason': 'x'},
    {'unsent': 4, 'unsent_reason': 'y'},
    {'refused': 6, 'last_refusal': Refusal.STALE},
    {'limited': 2},
    {'setpoint_errors': 1},
    {'gaps': 1},
)


def fifth(value, tenth):
    """Return how much of a burst has come in its five tenths of a second."""
    return value * min(max(tenth, 0), 5) // 5


@pytest.mark.parametrize('burst', COUNTS)
def test_a_burst_is_warned_of_in_the_same_words_for_as_long_as_the_window_lasts(burst):
    exchange, standing, told = driving(), ActiveFindings(), []
    health = Health(exchange, PARAMETERS, BEGIN, lockstep=False)
    for tenth in range(300):
        now = exchange.last_received = BEGIN + tenth * S // 10
        change(exchange, {'samples': 100})
        for key, value in burst.items():
            number = isinstance(value, int)
            change(exchange, {key: fifth(value, tenth - 49) - fifth(value, tenth - 50) if number else value})
        verdict = standing.keep(health.judge(now))
        told.append((verdict.level, verdict.sentence))
    warned = [tenth for tenth, (level, _) in enumerate(told) if level is Level.WARN]
    assert warned == list(range(warned[0], warned[-1] + 1))
    assert 50 <= warned[0] <= 54
    assert 50 + 10 * WINDOW <= warned[-1] + 1 <= 54 + 10 * WINDOW
    assert {level for level, _ in told} == {Level.OK, Level.WARN}
    assert len(set(told)) == 2


def test_what_was_found_earlier_does_not_hide_what_is_found_now():
    sentence = verdict(lost=500, driving=False, invalid_displacements=3).sentence
    for words in ('no setpoint for 20 ms', '500 samples lost', 'not valid in 3 samples'):
        assert words in sentence


def test_the_figures_tell_the_window_beside_the_whole():
    figures = verdict(lost=2).figures
    assert (figures['samples'], figures['recent.samples'], figures['recent.lost']) == (10_000, 1000, 2)
