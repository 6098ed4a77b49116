"""Friction and wear of the pads over the starts of a simulated car: found as they truly are, or refused."""

import json
import re
from datetime import UTC, datetime, timedelta

import numpy as np
import pytest
from typer.testing import CliRunner

import engine_mount
from engine_mount.cli.command import app
from engine_mount.drives.loop.recording import record_core
from engine_mount.identification.fitting import IdentificationError
from engine_mount.identification.pads import PadHistory, Probe, Start, relative_friction, trend
from mount_models.friction.coefficient import FrictionCoefficients
from mount_recorder.session import session_text

PROBE = {
    'policy': 'pad_probe',
    'pad_probe.wait': 1.2,
    'pad_probe.pulse_duration': 0.7,
    'pad_probe.pulses': 10.0,
}
STANDING = {'motorway.roughness': 0.0, 'motorway.gap_depth': 0.0, 'timeline.start': 2.8}
BEGIN = datetime(2026, 1, 1, tzinfo=UTC)
TRUE = {1.0: (200.0, 349.0), 0.85: (240.0, 346.0), 1.15: (160.0, 343.0), 1.001: (170.0, 340.0)}
"""{friction: (idle force, contact gap)}, one of each start, in N and um."""
CONSTANT = FrictionCoefficients(a_p2=1e-4, a_n2=1e-4)


@pytest.fixture(scope='module')
def record(tmp_path_factory):
    """Return a function that records one start of the car."""

    def recorded(number, control=PROBE, seconds=14.8, **sim):
        folder = tmp_path_factory.mktemp('start') / f'start_{number}'
        sim = {**STANDING, 'idle.amplitude': 200.0, 'timeline.duration': seconds, 'seed': number, **sim}
        parameters = {'mount_sim': sim, 'mount_control': control}
        started = (BEGIN + timedelta(days=number)).isoformat()
        record_core(folder, parameters, session_text({'parameters': parameters, 'started': started}))
        return folder

    return recorded


@pytest.fixture(scope='module')
def starts(record):
    return [
        record(
            number, **{'friction.scale': scale, 'idle.amplitude': idle, 'mechanics.contact_gap': gap * 1e-6}
        )
        for number, (scale, (idle, gap)) in enumerate(TRUE.items(), 1)
    ]


@pytest.fixture(scope='module')
def history(starts):
    return engine_mount.identify.pads(starts[::-1])  # in the order of time, not in that of the arguments


def test_friction_is_that_of_the_simulated_pads_whatever_the_idle_force(history):
    for start, true in zip(history.starts, TRUE, strict=True):
        friction, std = start.friction
        assert friction == pytest.approx(true, rel=0.035)
        assert abs(friction - true) < 3.0 * std < 0.12


def test_wear_is_the_contact_gap_that_is_lost(history):
    assert [1e6 * start.contact_gap for start in history.starts] == pytest.approx(
        [gap for _, gap in TRUE.values()], abs=1.5
    )
    assert history.wear.slope == pytest.approx(-3e-6, abs=history.wear.interval)
    assert history.wear.interval < 1.5e-6
    assert history.friction.interval > abs(history.friction.slope)


def test_the_command_writes_figures_and_picture(history, starts, tmp_path):
    json_file, figure = tmp_path / 'pads.json', tmp_path / 'pads.png'
    places = list(map(str, starts))
    ran = CliRunner().invoke(
        app, ['identify', 'pads', *places, '--json', str(json_file), '--figure', str(figure)]
    )
    assert ran.exit_code == 0, ran.output
    found = json.loads(json_file.read_text())
    assert [tuple(each['friction']) for each in found['starts']] == [each.friction for each in history.starts]
    assert found['conclusion'] == history.sentences()
    assert figure.stat().st_size > 10_000


@pytest.mark.parametrize(
    ('sim', 'words'),
    [
        ({'idle.amplitude': 0.0}, r'0\.. um in the pauses .* idling engine'),
        (
            {'motorway.roughness': 2e-6, 'motorway.speed': 12.0},
            r'% of the line \(limit 10%\): probe at standstill',
        ),
        ({'motorway.gap_depth': 0.02, 'motorway.gap_time': 1.3}, 'probe at standstill'),
    ],
)
def test_a_probe_that_proves_nothing_gives_a_reason_and_the_wear(record, starts, sim, words):
    last = engine_mount.identify.pads([starts[0], record(9, seconds=8.0, **sim)]).starts[-1]
    assert last.friction is None
    assert pytest.approx(349.0, abs=1.5) == 1e6 * last.contact_gap
    assert re.search(words, last.note), last.note


def probed(scale, idle=6e-5, frequency=26.7):
    force = np.linspace(2.0, 40.0, 12)
    return Probe(frequency, force, idle / (1.0 + (4e-6 * scale * force / idle) ** 2), np.full(12, idle))


def test_the_idle_force_and_the_shape_of_the_curve_do_not_matter():
    for scale, idle in ((0.7, 6e-5), (1.0, 4e-5), (1.3, 9e-5)):
        friction, std = relative_friction(probed(1.0), probed(scale, idle), CONSTANT)
        assert friction == pytest.approx(scale, abs=0.01)
        assert 0.015 <= std / friction < 0.02


def test_another_idle_speed_is_an_error_or_refused():
    assert relative_friction(probed(1.0), probed(1.0, frequency=26.2), CONSTANT)[1] > 0.04
    with pytest.raises(IdentificationError, match=r'idled at 30\.0 Hz, at 26\.7 Hz .* \(limit 5%\)'):
        relative_friction(probed(1.0), probed(1.0, frequency=30.0), CONSTANT)


def test_pulses_that_do_not_slow_the_engine_are_no_curve():
    with pytest.raises(IdentificationError, match='0 pulses of the first probe'):
        relative_friction(probed(0.01), probed(1.0), CONSTANT)
    with pytest.raises(IdentificationError, match='0 pulses slow the engine'):
        relative_friction(probed(1.0), probed(0.01), CONSTANT)


def test_a_trend_needs_three_starts_and_says_how_sure_it_is():
    assert trend([1.0, None, 2.0]) is None
    falling = trend([1.0, 0.9, None, 0.7, 0.6])
    assert falling.slope == pytest.approx(-0.1)
    assert falling.interval < 1e-9
    scattered = trend([1.0, 1.2, 0.9, 1.1])
    assert abs(scattered.slope) < scattered.interval


def worn(number, reserve, friction=None):
    return Start(f'{number}', None, 2.85e-4 + reserve, 3e-7, reserve, None, '', friction and (friction, 0.01))


@pytest.mark.parametrize(
    ('starts', 'words'),
    [
        ([worn(1, 6e-5, 1.0)], ['0.0 um since the first start; 60 um are left', '1.00 ± 0.01 of that']),
        (
            [worn(1, 6e-5), worn(2, 9e-6)],
            ['51.0 um .* 9 um are left .limit 10 um.: replace', 'unknown: record'],
        ),
        (
            [worn(k, (60 - k) * 1e-6, 0.8) for k in range(4)],
            ['for about 57 starts', r'limits 0.85 .. 1.15.: clean'],
        ),
    ],
)
def test_the_conclusion_has_value_limit_and_remedy(starts, words):
    for sentence, wanted in zip(PadHistory(starts).sentences(), words, strict=True):
        assert re.search(wanted, sentence), sentence


@pytest.mark.parametrize(
    ('which', 'words'),
    [(['first', 'first'], 'the same to the bit'), (['nowhere'], 'cannot be read')],
)
def test_recordings_that_cannot_be_a_history_are_refused(starts, which, words):
    places = [str(starts[0]) if each == 'first' else each for each in which]
    ran = CliRunner().invoke(app, ['identify', 'pads', *places])
    assert ran.exit_code != 0
    assert words in str(ran.exception) + ran.output
