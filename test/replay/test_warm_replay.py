"""A drive with a warm coil, replayed: the recorded temperature compensates as it did in the drive."""

import pytest

import engine_mount
from engine_mount.drives.inputs.input import measured_gaps
from engine_mount.drives.loop.recording import record_core
from engine_mount.drives.replay import replay
from engine_mount.recordings.reference import accept
from mount_recorder.session import session_text

SIM = {
    'scenario': 'bench',
    'timeline.start': 2.8,
    'timeline.duration': 0.4,
    'bench.amplitude': 0.0015,
    'electronics.coil_temperature': 55.0,
}


@pytest.fixture(scope='module')
def warm_drive(tmp_path_factory):
    folder = tmp_path_factory.mktemp('warm') / 'drive'
    parameters = {
        'mount_sim': SIM,
        'mount_init': {'coil_temperature_celsius': float('nan')},
        'mount_control': {'policy': 'continuous_viscous'},
    }
    record_core(folder, parameters, session_text({'parameters': parameters}))
    return folder


def test_a_replayed_initialisation_finds_its_gaps_to_the_bit(warm_drive, tmp_path):
    outcome = replay(warm_drive, out=tmp_path / 'replay')
    assert outcome.held
    (ramp,) = outcome.replayed.ramps
    (recorded,) = measured_gaps(engine_mount.open(warm_drive))
    assert ramp.gap.numbers == recorded.numbers
    assert abs(ramp.gap.numbers['rest_gap'] - 508e-6) < 5e-6  # without compensation some 40 um less
    kept = engine_mount.open(outcome.folder.recording)['coil_temperature']
    assert kept.stamps.tolist() == engine_mount.open(warm_drive)['coil_temperature'].stamps.tolist()
    assert set(kept['temperature']) == {55.0}


def test_a_reference_keeps_the_temperatures_of_its_initialisation(warm_drive, tmp_path):
    accepted = accept(engine_mount.open(warm_drive), 'warm', 'a warm coil', tmp_path)
    stamps = engine_mount.open(accepted.folder)['coil_temperature'].stamps
    assert stamps.tolist() == [100_000_000 * k for k in range(28)]
    assert replay(accepted.folder, out=tmp_path / 'replay').held
