"""The whole graph: real processes, real topics, from the CAN peer to the recording."""

import json
import re

import numpy as np
import pytest

import engine_mount
from engine_mount.drives.replay import replay
from engine_mount.recordings.audit import audit
from engine_mount.recordings.events import node_reports
from engine_mount.recordings.losses import losses
from engine_mount.recordings.session import recorded_sample_rate

DATA_TOPICS = (
    'displacement',
    'coil_ripple',
    'coil_temperature',
    'current_setpoint',
    'air_gap',
    'current_force_table',
    'control_trace',
    'sim/truth',
    'sim/chassis_acceleration',
    'sim/mount_force',
)
PROMISED_FIGURES = {
    'recording', 'recordings', 'restarts', 'scenario',
    'lost_samples', 'unanswered_samples', 'faults', 'real_time_factor',
    'rest_gap_m', 'contact_gap_m',
    'true_rest_gap_m', 'true_contact_gap_m', 'switch_on_s', 'switch_off_s', 'peak_displacement_m',
    'peak_current_a', 'tracking_error_rms', 'latency_median_s', 'latency_p99_s',
}  # fmt: skip


def _payloads(folder, topic):
    """Return the messages of a topic by time: reliable delivery may repair the order of two publishers."""
    series = engine_mount.open(folder / 'recording')[topic]
    payloads = [bytes(payload) for payload in series.payloads]
    if topic == 'current_force_table':  # has no stamp, and comes once
        return payloads
    return [payloads[place] for place in np.argsort(series.stamps, kind='stable')]


def _drive_both(command, *options, bus=()):
    """Drive in lock-step and in core: all data topics must be equal; return both results.

    `bus` are options of the drive in lock-step alone.
    """
    options = ('--set', 'mount_sim.timeline.start=2.9', *options)
    both = command.drive('--lockstep', *bus, *options), command.drive('--core', *options)
    assert [result.code for result in both] == [0, 0], both[0].output + both[1].output
    for topic in DATA_TOPICS:
        lockstep, core = (_payloads(result.folder, topic) for result in both)
        assert core, topic
        assert lockstep == core, topic
    return both


def test_lockstep_repeats_itself_in_any_namespace_and_in_several_files_and_equals_the_core_run(command):
    # long enough for two files by size; a split by wall time would depend on the speed of the machine
    options = ('--scenario', 'bench', '--duration', '2', '--set', 'mount_sim.timeline.start=2.9')
    first, _ = _drive_both(command, *options)
    second = command.drive('--lockstep', '--namespace', 'mount_right', '--split', '1MB', *options)
    assert second.code == 0, second.output
    for topic in DATA_TOPICS:
        assert _payloads(second.folder, topic) == _payloads(first.folder, topic), topic
    recording = engine_mount.open(second.folder / 'recording')
    topics = set(recording.topics)
    assert topics - {'/diagnostics'} == {name for name in topics if name.startswith('/mount_right/')}
    assert len(recording.files) > 1
    assert second.figures['lost_samples'] == 0
    assert losses(recording, audit(recording)).sound


@pytest.mark.slow
@pytest.mark.parametrize('bus', [('--apart',), ('--set', 'mount_driver.interface=udp_multicast')], ids=len)
def test_lockstep_on_a_bus_with_sockets_equals_the_core_run(command, bus):
    lockstep, _ = _drive_both(command, '--scenario', 'bench', '--duration', '1', bus=bus)
    assert lockstep.figures['lost_samples'] == lockstep.figures['unanswered_samples'] == 0


@pytest.mark.slow
def test_lockstep_equals_the_core_run_with_another_mount_excitation_and_switching_too(command):
    _, core = _drive_both(
        command, '--mount', 'hydro', '--set', 'mount_control.policy=switched_viscous',
        '--set', 'mount_control.switching=always', '--scenario', 'sweep',
        '--duration', '1', '--set', 'mount_sim.timeline.start=3',
        '--set', 'mount_sim.sweep.first_frequency=8', '--set', 'mount_sim.idle.amplitude=200',
        '--set', 'mount_sim.electronics.coil_temperature=55.04',
    )  # fmt: skip
    measured = engine_mount.open(core.folder / 'recording')['coil_temperature']['temperature']
    assert set(measured) == {55.0}
    active = engine_mount.open(core.folder / 'recording')['control_trace']['damping_active']
    assert bool(active[:200].all()) is False
    assert bool(active[200:].all()) is True


@pytest.mark.slow
def test_lockstep_equals_the_core_run_at_2_khz_and_nothing_counts_as_lost(command):
    both = _drive_both(command, '--sample-rate', '2000', '--scenario', 'bench', '--duration', '0.5')
    for result in both:
        recording = engine_mount.open(result.folder / 'recording')
        assert recorded_sample_rate(recording) == 2000.0
        assert set(np.diff(recording['displacement'].stamps)) == {500_000}
        assert result.figures['lost_samples'] == result.figures['unanswered_samples'] == 0
    replayed = replay(both[1].folder / 'recording')
    assert replayed.agreement is not None
    assert replayed.agreement.equal


@pytest.mark.slow
def test_lockstep_equals_core_run_and_replay_where_the_engine_sends_its_speed(command):
    options = ('--duration', '0.5', '--set', 'mount_sim.idle.amplitude=60')
    both = _drive_both(command, *options, '--set', 'mount_sim.idle.speed_sent=true')
    lockstep, core = (_payloads(result.folder, 'engine_speed') for result in both)
    assert len(core) == 340
    assert lockstep == core
    for result in both:
        trace = engine_mount.open(result.folder / 'recording')['control_trace']
        assert np.unique(trace['crank_frequency']) == pytest.approx([13.35], abs=0.003)
        replayed = replay(result.folder / 'recording')
        assert replayed.agreement is not None
        assert replayed.agreement.equal


@pytest.mark.slow
def test_lockstep_equals_the_core_run_over_a_measured_road(command):
    places = np.arange(0.0, 12.0, 0.02)  # m
    height = 0.01 * np.sin(2.0 * np.pi * places / 1.1) + 0.004 * np.sin(2.0 * np.pi * places / 0.3)
    road = command.folder / 'road.csv'
    np.savetxt(road, np.c_[places, height], delimiter=',', header='distance [m],height [m]', comments='')
    _, core = _drive_both(command, '--road', str(road), '--speed', '20/3.6')
    assert np.ptp(engine_mount.open(core.folder / 'recording')['sim/truth']['road_height']) > 0.01


@pytest.mark.real_time
def test_real_time_drive_records_every_sample_and_damps_the_gap(drive_in_time, tmp_path):
    figures_file = tmp_path / 'figures.json'
    result = drive_in_time(
        '--duration', '3', '--set', 'mount_sim.motorway.gap_time=1.0',
        '--set', 'mount_sim.motorway.gap_depth=0.03', '--json', str(figures_file),
    )  # fmt: skip
    assert result.code == 0, result.output
    figures = json.loads(figures_file.read_text())
    assert figures == result.figures
    assert set(figures) >= PROMISED_FIGURES
    assert figures['lost_samples'] == figures['unanswered_samples'] == 0
    assert figures['faults'] == []
    assert len(figures['switch_on_s']) == 1
    assert 0.0 < figures['switch_on_s'][0] - figures['excitation_start_s'] < 1.5
    assert figures['contact_gap_m'] == pytest.approx(figures['true_contact_gap_m'], abs=3e-6)
    assert figures['rest_gap_m'] == pytest.approx(figures['true_rest_gap_m'], abs=6e-6)
    assert set(figures['beside']) == {'hydromount', 'no current'}
    numbers = [figures['peak_displacement_m'], *figures['beside'].values()]
    peaks = '{:.2f} mm; hydromount {:.2f} mm; no current {:.2f} mm'.format(*(1e3 * each for each in numbers))
    assert re.search(f'peak displacement +{peaks}', result.output)
    picture, page = ((result.folder / name).read_text() for name in ('drive.svg', 'report.html'))
    assert f'<!-- Largest displacement: {peaks} -->' in picture  # a text that is drawn
    for name in ('this mount', 'hydromount', 'no current', 'degree of damping'):
        assert f'<!-- {name} -->' in picture
        assert f'"name":"{name}"' in page
    words = ' '.join(re.sub('<[^>]*>', ' ', page).split())
    better = ', '.join(rf'better by \d+ % than {mount} \(\S+ mm\)' for mount in ('hydromount', 'no current'))
    assert re.search(rf'Isolation \(good\) peak displacement \S+ mm, {better}', words)
    assert (result.folder / 'drive.png').stat().st_size > 10_000
    recording = engine_mount.open(result.folder / 'recording')
    assert not [report for report in node_reports(recording) if report.is_error]  # nor when it ended
    assert set(recording.topics) >= {f'/{topic}' for topic in DATA_TOPICS}
    assert 'scenario: motorway' in recording.latched('session').data
