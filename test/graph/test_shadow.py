"""Electronics that compute the law in C themselves, in the whole graph, and mount_control in shadow."""

import numpy as np
import pytest
from c_controller import built, exported

import engine_mount
from engine_mount.recordings.events import node_reports
from mount_ros.topics import DIAGNOSTICS, EVENT, SESSION, TOPICS

DATA = [topic.name for topic in TOPICS if topic not in (DIAGNOSTICS, EVENT, SESSION)]


@pytest.fixture
def drive(command, tmp_path):
    """Return a function that drives in lock-step, perhaps with a law in C, and returns the recording."""

    def driven(values=None):
        options = ['--lockstep', '--duration=1.5', '--set=mount_sim.timeline.start=2.9']
        options += ['--set=mount_sim.motorway.gap_time=0.2', '--set=mount_sim.motorway.gap_depth=0.05']
        if values is not None:
            library = built(exported(tmp_path / f'law_{len(values)}', values), 'gcc')
            nodes = 'mount_control', 'mount_driver', 'mount_recorder'
            options += [f'--set={node}.shadow=true' for node in nodes]
            options += [f'--set=mount_sim.controller_library={library}']
        result = command.drive(*options)
        assert result.code == bool(values), result.output
        return engine_mount.open(result.folder / 'recording')

    return driven


def payloads(recording, name):
    return sorted(bytes(payload) for payload in recording[name].payloads)


def test_the_law_in_the_electronics_drives_as_mount_control_does_to_the_bit(drive):
    normal, shadow = drive(), drive({})
    assert set(shadow.topics) - set(normal.topics) == {'/electronics_table', '/electronics_setpoint'}
    for name in DATA:
        assert payloads(shadow, name) == payloads(normal, name), name
    assert max(shadow['current_setpoint']['coil_current']) > 0.5
    own, host = shadow['electronics_setpoint'], shadow['control_trace']
    running = np.isfinite(own['coil_current'])
    assert own.stamps[running].tolist() == host.stamps.tolist()
    assert own['coil_current'][running].tobytes() == host['current'].tobytes()
    assert not [report for report in node_reports(shadow) if report.is_error]


def test_a_coefficient_of_the_law_in_the_electronics_that_differs_is_reported(drive):
    recording = drive({'continuous_viscous.damping_coefficient': 3200.0000000000005})
    own, host = recording['electronics_setpoint'], recording['control_trace']
    running = np.isfinite(own['coil_current'])
    different = np.flatnonzero(own['coil_current'][running] != host['current'])
    stamp, first = host.stamps[different[0]], different[0]
    pair = own['coil_current'][running][first], host['current'][first]
    words = f'electronics ({pair[0]} A) differs from that of mount_control ({pair[1]} A) for the sample of'
    reports = [report for report in node_reports(recording) if report.node == 'mount_control']
    assert any(f'{words} {1e-9 * stamp:.3f} s' in report.sentence for report in reports)
