"""The verdict says what is wrong, how much, and what to do."""

import re

import pytest

from mount_driver.codec import Status
from mount_driver.diagnosis import LinkWatch, Snapshot, judge
from mount_driver.link import Refusal
from mount_driver.parameters import DriverParameters
from mount_ros.nodes.diagnostics import Level

PARAMETERS = DriverParameters(interface='socketcan', channel='can0')
BEFORE = Snapshot(time=9.0, samples=9_000, setpoints=9_000, driving=True, status=Status(13.8, 40.0))
NOW = BEFORE._replace(time=10.0, samples=10_000, setpoints=10_000, latest_stamp=10_000_000_000)


def verdict(*, lockstep=False, **changes):
    return judge(NOW._replace(**changes), BEFORE, PARAMETERS, lockstep=lockstep)


def test_a_sound_link_is_ok_with_its_figures():
    sound = verdict()
    assert (sound.level, sound.sentence) == (Level.OK, 'link to the electronics is up')
    assert sound.figures['last_stamp'] == 10_000_000_000
    assert sound.figures['samples'] == 10_000
    assert sound.figures['supply_voltage'] == 13.8


@pytest.mark.parametrize(
    ('changes', 'level', 'sentence'),
    [
        ({'failure': 'gone'}, Level.ERROR, 'stopped at 0 A: gone'),
        ({'trouble': 'network down'}, Level.ERROR, 'CAN bus lost: network down; setpoints are dropped'),
        ({'bus_off': True}, Level.ERROR, 'socketcan can0 is bus off'),
        ({'frame_age': 0.15}, Level.ERROR, 'no frames .* more than 100 ms; .*powered, is socketcan can0 up'),
        ({'frame_age': 7.6}, Level.ERROR, 'no frames from the electronics for 7 s'),
        (
            {'fault': 'too hot'},
            Level.ERROR,
            'switched off: too hot, then activate mount_driver, mount_init',
        ),
        ({'held': 'no sensor'}, Level.ERROR, 'coil at 0 A while this lasts: no sensor'),
        ({'fault': 'too hot', 'refused': 9, 'frame_age': 9.0, 'driving': False}, Level.ERROR, 'too hot'),
        ({'setpoint_errors': 1}, Level.WARN, 'damaged, repeated or of wrong sequence; they do not use'),
        ({'status': Status(13.8, 120.1)}, Level.WARN, r'120\.1 degC\) is above 120 degC; lower'),
        ({'lost': 2}, Level.WARN, r'2 samples lost and 0 frames corrupt .*0\.20 %, limit 0\.1 %'),
        ({'corrupt': 5}, Level.WARN, '0 samples lost and 5 frames corrupt'),
        ({'invalid_displacements': 3}, Level.WARN, 'not valid in 3 samples'),
        ({'gaps': 1}, Level.WARN, 'no samples for more than 1 s; check their supply .* activate the graph'),
        (
            {'fault': 'x', 'other_senders': 3, 'other_sender_age': 0.1},
            Level.ERROR,
            'x, then .* again; it still sends',
        ),
        (
            {'fault': 'x', 'other_senders': 3, 'other_sender_age': 9.0},
            Level.ERROR,
            'again; silent for more than 1 s',
        ),
        (
            {'celsius': 150.04, 'current_limit': 2.0},
            Level.WARN,
            r'about 150 degC by the thermal model: .* 2\.0 A \(lowered from 140 .* 170 degC\); damp less',
        ),
        ({'repeated': 7}, Level.WARN, '7 frames repeated and 0 of wrong sequence'),
        ({'wrong_sequence': 1}, Level.WARN, '1 of wrong sequence .* not used; did the electronics restart'),
        (
            {'unreadable': 2, 'unreadable_reason': 'TypeError: x'},
            Level.WARN,
            r'2 .* not be read .*TypeErr.* another',
        ),
        ({'unsent': 4, 'unsent_reason': 'OSError: full'}, Level.WARN, r'4 .* not taken .*\(OSError: full\)'),
        ({'refused': 6, 'last_refusal': Refusal.STALE}, Level.WARN, '6 setpoints refused.*older than'),
        ({'driving': False, 'timeouts': 1}, Level.WARN, 'no setpoint for 20 ms; is mount_control active'),
        ({'limited': 2}, Level.WARN, '2 setpoints limited to 3 A'),
    ],
)
def test_a_finding_has_its_level_and_sentence(changes, level, sentence):
    found = verdict(**changes)
    assert found.level == level
    assert re.search(sentence, found.sentence)


@pytest.mark.parametrize('changes', [{'lost': 1}, {'frame_age': 0.09}, {'status': Status(13.8, 119.9)}])
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
    found = judge(NOW._replace(unheard=True), BEFORE._replace(unheard=True), PARAMETERS, lockstep=False)
    assert 'do not take the setpoints' in found.sentence


def test_the_gravest_finding_speaks():
    assert verdict(lost=500, frame_age=3.0).sentence.startswith('no frames')


def test_in_lock_step_waiting_is_no_fault():
    assert verdict(frame_age=100.0, lockstep=True).level == Level.OK


def test_before_the_first_setpoint_0_ampere_is_no_fault():
    assert verdict(setpoints=0, driving=False).level == Level.OK


def test_old_losses_are_forgotten_after_a_second():
    watch = LinkWatch()
    for tenth in range(30):
        now = Snapshot(time=tenth / 10, samples=100 * tenth, lost=50 if tenth >= 5 else 0)
        level = judge(now, watch.earlier(now), PARAMETERS, lockstep=False).level
        assert level == (Level.WARN if 5 <= tenth < 15 else Level.OK), tenth
