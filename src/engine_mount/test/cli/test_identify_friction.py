"""`engine-mount identify friction` from files to files."""

import hashlib
import json

import numpy as np
import pytest
from command_line import command, refused

from engine_mount.cli.commands.options import with_repeated_options
from engine_mount.experiments.harness.rack_recording import record_friction_rack
from engine_mount.identification.friction import ladder
from engine_mount.identification.friction.files import friction_mapping as said
from engine_mount.identification.friction.files import read_recording
from engine_mount.identification.friction.screening import subtract_zero
from engine_mount.recordings.recording import recording_hash
from engine_mount.settings.chosen import chosen_control
from mount_models.friction.coefficient import FrictionCoefficients, offset_coefficient
from mount_models.friction.contact import FrictionContact
from mount_models.specimen import default_specimen, load_specimen
from mount_sim.rack import (
    RackNoise,
    move,
    ramp_and_hold,
    sawtooth,
    sawtooth_corners,
    with_noise,
    write_csv,
)

SPEEDS = (0.002, 0.004, 0.006, 0.010)


@pytest.fixture(scope='module')
def rack(tmp_path_factory):
    folder = tmp_path_factory.mktemp('rack')
    write_csv(ramp_and_hold(duration=4.0), folder / 'ramp.csv', with_desired=True)
    for seed, load in enumerate((40.0, 80.0, 120.0)):
        write_csv(
            sawtooth(noise=RackNoise(seed=seed), normal_force=load, speeds=SPEEDS), folder / f'{load:.0f}.csv'
        )
    return folder


def test_several_paths_after_one_option_become_repeated_options():
    words = ['identify', 'friction', '--train', 'a', 'b', '--json', 'd', '--held-out', 'e']
    assert with_repeated_options(words) == [*words[:4], '--train', *words[4:]]
    assert with_repeated_options(['--train', 'a', '--', 'b']) == ['--train', 'a', '--', 'b']
    assert with_repeated_options(['--train=a', 'b']) == ['--train=a', 'b']


@pytest.mark.slow
def test_files_give_parameters_and_a_ladder(rack, tmp_path, monkeypatch):
    # a search from fewer starts on fewer samples: which law is best here is no close race
    for name, value in (('SEARCH_SAMPLES', 400), ('FINAL_SAMPLES', 1500), ('STARTS', 2), ('DRAWS', 4)):
        monkeypatch.setattr(ladder, name, value)
    train, figures, written = ('ramp.csv', '40.csv', '120.csv'), tmp_path / 'f.json', tmp_path / 'f.yaml'
    command(
        'identify', 'friction', '--train', *(rack / name for name in train), '--held-out', rack / '80.csv',
        '--json', figures, '--out', written, '--figure', tmp_path / 'f.png',
    )  # fmt: skip
    result = json.loads(figures.read_text())
    assert result['best'] == "paper's model"
    assert result['ladder']["paper's model"]['held_out_error'] < 0.05
    assert result['contact']['contact_stiffness'] == pytest.approx(4e6, rel=0.03)
    specimen = load_specimen(written)
    assert specimen.friction == pytest.approx({**result['coefficients'], **result['contact']})
    assert specimen.force_law == default_specimen().force_law
    told = specimen.provenance['parts']['friction']
    digests = {name: recording_hash(rack / name) for name in (*train, '80.csv')}
    assert {entry['file']: entry['sha256'] for entry in told['recordings']} == digests
    held_out = {'file': '80.csv', 'part': 'held out', 'kind': 'sawtooth', 'sha256': digests['80.csv']}
    assert held_out in told['recordings']
    assert told['valid']['normal_force'] == pytest.approx([40.0, 120.0], rel=0.01)
    assert told['residuals']['held_out']['80.csv'] < 0.05
    drive = chosen_control({'mount_control': {'parameters_file': str(written)}})
    assert drive.friction._asdict() == pytest.approx(result['coefficients'])
    assert (tmp_path / 'f.png').stat().st_size > 10_000


@pytest.mark.parametrize(
    ('suffix', 'content', 'words'),
    [
        (
            'csv',
            b'time_s,displacement_mm,friction_force_n,normal_force_n\n0,0,1,9\n0.001,1,1,9\n',
            '2 samples',
        ),
        ('csv', b't,f\n0.0,1.5\n', 'no column for displacement'),
        ('json', b'{"data": [[1, 2]]}', 'shape'),
        ('png', b'\x89PNG\r\n\0' * 9, 'are not read'),
    ],
)
def test_bad_files_are_refused_and_nothing_is_written(suffix, content, words, tmp_path):
    bad = tmp_path / f'bad.{suffix}'
    bad.write_bytes(content)
    targets = ('--json', tmp_path / 'f.json', '--out', tmp_path / 'f.yaml', '--figure', tmp_path / 'f2.png')
    assert words in refused('identify', 'friction', '--train', bad, *targets)
    assert list(tmp_path.iterdir()) == [bad]


def test_a_recording_of_the_rack_is_read_as_it_measured_and_identified(tmp_path):
    rack = move(
        FrictionContact(), FrictionCoefficients(), *sawtooth_corners(2.5e-3, (2e-3, 4e-3, 6e-3, 8e-3)), 100.0
    )
    samples = with_noise(rack, force_noise=0.5, displacement_noise=0.0, seed=1)
    recording = record_friction_rack(tmp_path / 'sawtooth', samples, {'scenario': 'sawtooth'})
    (tmp_path / 'run').mkdir()
    (tmp_path / 'run' / 'recording').symlink_to(recording, target_is_directory=True)
    write_csv(samples, tmp_path / 'same.csv')
    (file,) = recording.glob('*.mcap')
    for place, exact in (
        (recording, 1e-9),
        (file, 1e-9),
        (tmp_path / 'run', 1e-9),
        (tmp_path / 'same.csv', 1e-4),
    ):
        read = read_recording(place)
        assert read.displacement == pytest.approx(samples.displacement, abs=1e-9)
        assert read.force == pytest.approx(samples.friction_force, abs=exact)
        assert read.normal_force == pytest.approx(np.full((read.force.size, 2), 100.0))
        assert read.dt == pytest.approx(1e-3, rel=1e-6)
    command('identify', 'friction', '--step', 'sawtooth', '--train', recording, '--json', tmp_path / 'f.json')
    found = json.loads((tmp_path / 'f.json').read_text())
    assert found['recordings']['sawtooth']['kind'] == 'sawtooth'
    coefs = FrictionCoefficients(**found['coefficients'])
    assert offset_coefficient(coefs, 0.006, 100.0) == pytest.approx(
        offset_coefficient(FrictionCoefficients(), 0.006, 100.0), abs=0.01
    )


def test_a_held_out_recording_must_be_unseen_under_another_name_too(rack, tmp_path):
    seen, copy, out = rack / '40.csv', tmp_path / 'other.csv', tmp_path / 'f.json'
    copy.write_bytes(seen.read_bytes())
    order = ('identify', 'friction', '--train', seen, '--json', out, '--held-out')
    assert 'must be unseen' in refused(*order, seen)
    assert 'other.csv and 40.csv (train) are the same to the bit' in refused(*order, copy)
    assert not out.exists()


def test_the_hash_of_a_recording_is_that_of_its_data_in_order(tmp_path):
    run = tmp_path / 'run' / 'recording'
    run.mkdir(parents=True)
    for name, content in (('b_1.mcap', b'second'), ('a_0.mcap', b'first'), ('metadata.yaml', b'x')):
        (run / name).write_bytes(content)
    expected = hashlib.sha256(b'firstsecond').hexdigest()
    assert recording_hash(run) == recording_hash(tmp_path / 'run') == expected
    other = tmp_path / 'other'
    for name, content in (('t.npy', b'second'), ('a/value.npy', b'first')):
        (other / name).parent.mkdir(parents=True, exist_ok=True)
        (other / name).write_bytes(content)
    assert recording_hash(other) == expected


def test_parameters_need_ramp_and_sawtooth(rack, tmp_path):
    out = tmp_path / 'f.yaml'
    said = refused('identify', 'friction', '--train', rack / 'ramp.csv', '--out', out)
    assert 'the sawtooth is missing' in said
    assert not out.exists()


def rig_file(folder):
    time = np.arange(0.0, 4.0, 1e-3)
    moved = np.clip(time - 0.5, 0.0, None)
    table = np.column_stack(
        [time, np.sin(3 * moved), 2 * np.sign(np.cos(3 * moved)) * (time > 0.5) - 0.07, 0 * time,
         np.where(np.cos(3 * moved) > 0, 10.0, 900.0), np.where(np.cos(3 * moved) > 0, 1000.0, 10.0)]
    )  # fmt: skip
    file = folder / 'rig.json'
    file.write_text(json.dumps({'data': table.tolist()}))
    return file


def test_the_damper_json_is_converted_to_si_and_its_force_zero_removed(tmp_path):
    read = read_recording(rig_file(tmp_path))
    by_law, _ = subtract_zero(read)
    assert by_law.force[:400] == pytest.approx(0.0, abs=40.0)  # of +- 8896 N
    assert 'from the loop' in by_law.notes[-1]
    assert read.displacement.max() == pytest.approx(0.0254, rel=1e-3)
    assert np.ptp(read.force) == pytest.approx(4 * 4448.2216, rel=1e-6)
    assert read.normal_force[0] == pytest.approx([4448.2216, 0.9 * 4448.2216], rel=1e-3)
    assert read_recording(rig_file(tmp_path), clamp='none').normal_force[0] == pytest.approx([1.0, 1.0])


def test_channels_are_heard_for_json_too(tmp_path):
    file = rig_file(tmp_path)
    as_made = read_recording(file, clamp='none')
    table = np.array(json.loads(file.read_text())['data'])
    file.write_text(json.dumps({'data': table[:, [0, 2, 1, 3, 4, 5]].tolist()}))
    for texts in (
        ['displacement=2:inch', 'friction_force=1:kip'],
        ['displacement=friction_force_kip:inch', 'friction_force=displacement_in:kip'],
    ):
        found = read_recording(file, said(texts), clamp='none')
        np.testing.assert_array_equal(found.displacement, as_made.displacement)
        np.testing.assert_array_equal(found.force, as_made.force)
