"""`engine-mount check` on a short suite in core: verdicts, exit codes, and the same bytes in every run."""

import json

import pytest
from command_line import command
from typer.testing import CliRunner

from engine_mount.cli.command import app

SUITE = """
limits:
  faults: {at_most: 0, source: contract, reason: none is brought in}
  unanswered_samples: {at_most: 0, source: contract, reason: each sample has its setpoint}
  rest_gap_error_um: {at_most: 5, source: chosen, reason: a third of what the driver warns of}
manoeuvres:
  gap:
    about: A gap of 20 mm.
    evaluated_from_s: 0.5
    set:
      mount_sim.scenario: motorway
      mount_sim.timeline.start: 3.5
      mount_sim.timeline.duration: 1.5
      mount_sim.motorway.gap_depth: 0.02
      mount_sim.motorway.gap_time: 0.5
    limits:
      peak_over_undamped: {at_most: 0.71, source: derived, reason: what an ideal damper leaves}
      switched_on: {at_least: 1, at_most: 6, source: chosen, reason: a gap is damped}
  rack:
    about: 8 Hz, 1 mm.
    set: {mount_sim.scenario: bench, mount_sim.timeline.start: 3.5, mount_sim.timeline.duration: 1.5}
    limits:
      cycle_loss_over_hydromount: {at_least: 1, source: chosen, reason: no less than what it replaces}
      friction_error_percent: {at_most: 4, source: chosen, reason: what the chain is held to}
"""


@pytest.fixture
def check(tmp_path):
    """Run the command on the suite; returns its result and the figures that it wrote."""
    suite = tmp_path / 'ours.yaml'
    suite.write_text(SUITE, encoding='utf-8')

    def run(name, *options):
        figures, folder = tmp_path / f'{name}.json', tmp_path / name
        arguments = ['check', '--suite', suite, '--json', figures, '--out', folder, *options]
        ended = CliRunner(env={'COLUMNS': '80'}).invoke(app, list(map(str, arguments)))
        return ended, figures.read_bytes() if figures.exists() else b''

    return run


def failed(figures):
    return {
        (name, verdict['quantity'])
        for name, each in json.loads(figures)['manoeuvres'].items()
        for verdict in each['verdicts']
        if verdict['verdict'] == 'fail'
    }


@pytest.mark.slow
def test_the_default_controller_passes_with_the_same_bytes_whatever_the_jobs(check, tmp_path):
    one, figures = check('one', '--jobs', '1')
    assert one.exit_code == 0, one.output
    assert '2 of 2 manoeuvres within their 11 limits.' in one.output
    assert all(len(line) <= 80 for line in one.output.splitlines() if 'recordings' not in line)
    assert (tmp_path / 'one' / 'gap' / 'recording').is_dir()
    assert check('two', '--jobs', '2')[1] == figures
    gap = json.loads(figures)['manoeuvres']['gap']['figures']
    assert gap['peak_over_undamped'] < 0.71
    assert gap['pad_energy_j'] > 0.1


@pytest.mark.slow
@pytest.mark.parametrize(
    ('setting', 'caught'),
    [
        ('mount_sim.mount=friction_off', {('gap', 'peak_over_undamped'), ('rack', 'friction_error_percent')}),
        (
            'mount_control.continuous_viscous.damping_coefficient=650',
            {('gap', 'peak_over_undamped'), ('rack', 'cycle_loss_over_hydromount')},
        ),
        ('mount_sim.faults=[coil_open@3.8]', {('gap', 'peak_over_undamped')}),
    ],
)
def test_a_worse_controller_fails_by_name(check, setting, caught):
    ended, figures = check('worse', '--set', setting)
    assert ended.exit_code == 1, ended.output
    assert caught <= failed(figures)
    rows = [line.split() for line in ended.output.splitlines()]
    one, other, first, *_ = [row for row in rows if row[:1] in (['ok'], ['fail'])]
    assert {one[1], other[1]} == {'gap', 'rack'}  # told when they were done
    assert first[0] == 'fail'


def test_the_manoeuvres_are_listed():
    listed = command('check', '--list').splitlines()
    assert listed[0].split()[:2] == ['rest', 'Standing,']
    assert len(listed) == 16
