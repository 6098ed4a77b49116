"""An experiment through the real nodes."""

import json

import numpy as np

import mount_bags
from mount_bags.session_differences import session_text


def _setpoints(run):
    series = mount_bags.open(run / 'recording')['current_setpoint']
    order = np.argsort(series.stamps, kind='stable')
    return [bytes(series.payloads[place]) for place in order]


def test_an_experiment_through_the_nodes_gives_the_setpoints_and_figures_of_the_core(command):
    found = {}
    for mode, options in (('core', ()), ('lock-step', ('--graph',))):
        out, figures = command.folder / mode, command.folder / f'{mode}.json'
        process = command.start(
            'experiment', 'motorway_gap', '--out', str(out), '--json', str(figures), *options,
            '--set', 'motorway_gap.duration=2.5', '--set', 'motorway_gap.gap_time=0.5',
            '--set', 'motorway_gap.compared_depths=0.02,', '--set', 'mount_sim.timeline.start=2.9',
        )  # fmt: skip
        output, _ = process.communicate(timeout=240.0)
        assert process.returncode == 0, output
        found[mode] = json.loads(figures.read_text())
        assert found[mode].pop('mode') == mode
        assert f'mode: {mode}' in session_text(mount_bags.open(out / '20mm_friction' / 'recording'))
    assert found['core'] == found['lock-step']
    for run in ('20mm_friction', '20mm_hydromount', '20mm_friction_0A'):
        assert _setpoints(command.folder / 'core' / run) == _setpoints(command.folder / 'lock-step' / run)
