"""The manoeuvre suite through the real nodes: the figures of lock-step are those of core."""

import json

import pytest

pytestmark = pytest.mark.slow

LIMIT = 240.0  # s: only a hang takes so long


def test_a_manoeuvre_through_the_nodes_in_lock_step_has_the_figures_of_core(command):
    told = {}
    for through in ('core', 'lockstep'):
        file = command.folder / f'{through}.json'
        options = ('--only', 'rack', '--through', through, '--json', file, '--out', command.folder / through)
        process = command.start('check', *map(str, options))
        output, _ = process.communicate(timeout=LIMIT)
        assert process.returncode == 0, output
        told[through] = json.loads(file.read_text())
        assert told[through].pop('through') == through
    assert told['core'] == told['lockstep']
    assert told['core']['manoeuvres']['rack']['figures']['unanswered_samples'] == 0.0
