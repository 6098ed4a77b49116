"""The contract of the experiments, and each of them on a short version."""

import json

import pytest
import yaml
from command_line import command, refused

import engine_mount
from engine_mount.experiments import (
    field_penetration,
    force_characteristic,
    inductance_map,
    page,
    ramp_and_hold,
    sawtooth,
)
from engine_mount.experiments.harness.experiment import Claim, Experiment, Holds, Outcome, holds_if
from engine_mount.experiments.registry import NAMES, experiment, experiment_named, experiments_named
from engine_mount.recordings.audit import audit
from mount_models.friction.contact import FrictionContact

PNG = b'\x89PNG'
SHORT_SAWTOOTH = {
    'amplitude': 5e-4,
    'lowest_speed': 3e-3,
    'highest_speed': 5e-3,
    'speed_step': 2e-3,
    'lowest_normal_force': 100.0,
    'highest_normal_force': 100.0,
}


def check(outcome):
    json.dumps(outcome.figures, allow_nan=False)
    assert all(picture.read_bytes().startswith(PNG) for picture in outcome.pictures)
    assert outcome.pictures
    assert outcome.claims


# Contract and command.


def test_every_experiment_stands_under_its_own_name_and_says_what_it_repeats():
    for name in NAMES:
        known = experiment_named(name)
        assert known.name == name
        assert known.title
        assert known.reference.startswith('Fig')
    assert [each.name for each in experiments_named(['all'])] == list(NAMES)
    named = [line.split()[0] for line in command('experiment', '--list').splitlines() if line[1:2].strip()]
    assert named[2:] == list(NAMES)  # behind the head and its line


@pytest.mark.parametrize(
    ('arguments', 'sentence'),
    [
        (['sawtooth', '--set', 'sawtooth.amplitud=1'], 'did you mean amplitude'),
        (['sawtooth', '--set', 'sawtooth.amplitude=1'], 'must lie within 0.0005 .. 0.01 m'),
        (['sawtooth', '--set', 'mount_sim.seed=1'], "'mount_sim' is no owner of parameters here"),
        (['bench', '--set', 'bench.damper=stiff'], 'no damper curve'),
        (
            ['bench', '--set', 'mount_sim.mount=hydro'],
            'mount_sim.mount is set by the experiment bench itself',
        ),
        (['sawtooth', '--set', 'sawtooth.lowest_speed=0.05'], 'must not lie above highest_speed (0.01 m/s)'),
    ],
)
def test_a_wrong_order_is_refused_before_anything_is_made(arguments, sentence, tmp_path):
    out = tmp_path / 'out'
    assert sentence in refused('experiment', *arguments, '--out', out)
    assert not (out.exists() and any(out.iterdir()))


def test_a_folder_that_holds_something_is_refused(tmp_path):
    (tmp_path / 'precious').touch()
    assert 'is not empty; choose another folder' in refused('experiment', 'ramp_and_hold', '--out', tmp_path)


def test_the_command_writes_figures_page_and_pictures(tmp_path):
    out, figures, written = tmp_path / 'out', tmp_path / 'r.json', tmp_path / 'docs' / 'e.md'
    command(
        'experiment', 'ramp_and_hold', '--out', out, '--json', figures, '--page', written,
        '--set', 'ramp_and_hold.hold_time=2',
    )  # fmt: skip
    assert json.loads(figures.read_text())['time_constant_s'] > 0.0
    assert '![Ramp and hold of the sticking contact](figures/ramp_and_hold.png)' in written.read_text()
    assert (tmp_path / 'docs' / 'figures' / 'ramp_and_hold.png').read_bytes().startswith(PNG)


def test_the_page_puts_pictures_beside_claims_counts_answers_and_leads_to_an_own_page(
    tmp_path,
):
    picture, own = tmp_path / 'a.png', tmp_path / 'own.md'
    picture.write_bytes(PNG)
    own.write_text('own')
    ours = Claim('Fig. 2', 'so too', 'it was', Holds.YES)
    claims = [Claim('Fig. 1', 'it is so', 'it was not', Holds.NO, ours), ours]
    known = Experiment('bench', 'How.', FrictionContact(), lambda order: None)
    docs = tmp_path / 'docs'
    page.write_page([Outcome(known, {}, claims, [picture], [], [own])], docs / 'page.md')
    text = (docs / 'page.md').read_text()
    assert f'| [{known.title}](#bench) | Fig. 13 | 1 |  | 1 |  |' in text
    assert '| paper | statement | here | holds | with `continuous_viscous` | holds with it |' in text
    assert '| Fig. 1 | it is so | it was not | no | it was | yes |' in text
    assert '[own.md](own.md)' in text
    assert (docs / 'own.md').read_text() == 'own'
    assert (docs / 'figures' / 'a.png').exists()


@pytest.mark.parametrize(
    ('answers', 'holds'),
    [([True], Holds.YES), ([True, False], Holds.PARTLY), ([False], Holds.NO), ([], Holds.NOT_COMPARABLE)],
)
def test_a_claim_holds_where_it_came_out_in_all_cases(answers, holds):
    assert holds_if(answers) is holds


def test_without_noise_the_ramp_gives_the_true_parameters(tmp_path):
    outcome = experiment(ramp_and_hold.NAME, out=tmp_path / 'ramp', force_noise=0.0, displacement_noise=0.0)
    check(outcome)
    assert outcome.figures['time_constant_s'] == pytest.approx(0.44118, abs=2e-4)
    assert max(map(abs, outcome.figures['errors'].values())) < 5e-3
    assert abs(outcome.figures['errors_without_ramp_correction']['tangential_stiffness']) > 0.1
    sliding = experiment(ramp_and_hold.NAME, out=tmp_path / 'sliding', normal_force=60.0, hold_time=2.0)
    assert [each.claims[0].holds for each in (outcome, sliding)] == [Holds.YES, Holds.NO]


# Each experiment.


def test_the_saw_tooth_is_recorded_in_the_topics_of_a_drive_and_nothing_is_lost(tmp_path):
    outcome = experiment(sawtooth.NAME, out=tmp_path, **SHORT_SAWTOOTH)
    check(outcome)
    recording = engine_mount.open(outcome.recordings[0])
    assert set(recording.topics) == {'/session', '/displacement', '/sim/mount_force', '/sim/clamp_force'}
    lost = {name: topic.lost for name, topic in audit(recording).items() if name != '/session'}
    assert set(lost.values()) == {0}
    assert recording['sim/clamp_force']['wrench.force.z'].min() == 100.0
    session = yaml.safe_load(recording.latched('session').data)
    assert session['scenario'] == 'sawtooth'
    assert session['parameters']['sawtooth']['amplitude'] == 5e-4


def test_the_saw_tooth_gives_back_the_coefficients_of_its_pads(tmp_path):
    outcome = experiment(
        sawtooth.NAME, out=tmp_path, **SHORT_SAWTOOTH, force_noise=0.0, displacement_noise=0.0
    )
    assert outcome.figures['strokes'] == 4
    assert outcome.figures['a_rms_error'] < 3e-3
    assert outcome.figures['b_rms_error_per_mm'] < 0.5
    assert outcome.figures['simplified_error_macroslip'] < 0.01
    assert outcome.figures['simplified_error_microslip'] > 0.2
    assert outcome.figures['simplified_error_slow_macroslip'] is None  # no stroke was so slow


def test_the_force_characteristic_meets_the_published_accuracy_of_the_fit(tmp_path):
    outcome = experiment(force_characteristic.NAME, out=tmp_path)
    check(outcome)
    assert outcome.figures['law_relative_rms'] < 0.005
    assert outcome.figures['law_relative_worst'] < 0.01
    assert outcome.figures['force_at_1_a_n']['349 um'] == pytest.approx(96.12, abs=0.01)


def test_the_inductance_map_finds_the_gaps_of_the_assembled_actuator(tmp_path):
    outcome = experiment(inductance_map.NAME, out=tmp_path)
    check(outcome)
    figures = outcome.figures
    assert figures['ramp_gap_at_rest_m'] == pytest.approx(492e-6, abs=4e-6)
    assert figures['ramp_gap_at_crossing_m'] == pytest.approx(341.2e-6, abs=2e-6)
    assert figures['initialisation']['contact_gap'] == pytest.approx(349e-6, abs=2e-6)
    assert any(low <= 0.9 <= high for low, high in figures['ambiguous_currents_a'])
    assert any(low <= 0.2 <= high for low, high in figures['unique_currents_a'])
    (folder,) = outcome.recordings
    assert {'/coil_ripple', '/air_gap', '/session'} <= set(engine_mount.open(folder).topics)


def test_both_computations_of_the_penetration_agree_at_rest(tmp_path):
    outcome = experiment(field_penetration.NAME, out=tmp_path, highest_current=0.1, current_step=0.2)
    check(outcome)
    assert outcome.figures['currents_a'] == [0.0]
    assert outcome.figures['equivalent_depth_m'][0] == pytest.approx(16.15e-6, abs=0.02e-6)
    assert abs(outcome.figures['difference_in_middle'][0]) < 0.01
