"""An experiment through the real nodes."""

import json

import numpy as np
import pytest

import engine_mount
from engine_mount.cli.command import main
from engine_mount.recordings.session import recorded_session

pytestmark = pytest.mark.slow


def _setpoints(run):
    series = engine_mount.open(run / 'recording')['current_setpoint']
    order = np.argsort(series.stamps, kind='stable')
    return [bytes(series.payloads[place]) for place in order]


def test_an_experiment_through_the_nodes_gives_the_setpoints_and_figures_of_the_core(command):
    core, lockstep = command.folder / 'core', command.folder / 'lock-step'
    with pytest.raises(SystemExit) as ending:  # the core starts no process, so it needs none of its own
        main(_order(core))
    assert ending.value.code == 0
    process = command.start(*_order(lockstep), '--graph')
    output, _ = process.communicate(timeout=240.0)
    assert process.returncode == 0, output
    found = {}
    for out in (core, lockstep):
        found[out] = json.loads(out.with_suffix('.json').read_text())
        assert found[out].pop('mode') == out.name
        assert f'mode: {out.name}' in recorded_session(
            engine_mount.open(out / '20_mm_friction' / 'recording')
        )
    assert found[core] == found[lockstep]
    for run in ('20_mm_friction', '20_mm_hydromount', '20_mm_friction_0A'):
        assert _setpoints(core / run) == _setpoints(lockstep / run)


def _order(out):
    return [
        'experiment', 'motorway_gap', '--out', str(out), '--json', str(out.with_suffix('.json')),
        '--set', 'motorway_gap.duration=2.5', '--set', 'motorway_gap.gap_time=0.5',
        '--set', 'motorway_gap.compared_depths=0.02,', '--set', 'mount_sim.timeline.start=2.9',
    ]  # fmt: skip
