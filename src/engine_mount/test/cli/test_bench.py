"""The bench: each figure beside its alternative, told as a ratio and in a file."""

import json
import math
import os
import time

import pytest
from ros_testing import free_domain
from typer.testing import CliRunner

from engine_mount.cli.bench import bench, fleet
from engine_mount.cli.bench.chain_runs import Place, relay_in_turn
from engine_mount.cli.bench.comparison import Comparison
from engine_mount.cli.bench.processes import children, memory, processor_time
from engine_mount.cli.command import app


@pytest.fixture
def domain():
    with free_domain() as number:
        yield number


def test_only_the_groups_asked_for_are_measured_and_written(tmp_path, monkeypatch):
    row = Comparison('a thing', 2e-6, 'another', 8e-6)
    unknown = Comparison('growth', 1.0, 'none', 0.0, 'B')
    monkeypatch.setattr(bench, 'GROUPS', {'a': lambda *_: {'x': row, 'y': unknown}, 'b': lambda *_: 1 / 0})
    file = tmp_path / 'figures.json'
    result = CliRunner().invoke(app, ['bench', '--only', 'a', '--json', str(file)])
    assert result.exit_code == 0, result.output
    figures = json.loads(file.read_text())
    assert figures['x'] == {
        'what': 'a thing', 'ours': 2e-6, 'other': 8e-6, 'beside': 'another', 'unit': 's', 'ratio': 0.25,
    }  # fmt: skip
    assert figures['y']['ratio'] is None
    assert '2.00 µs' in result.output
    assert '0.25' in result.output


def test_an_unknown_group_is_refused_with_the_known_ones():
    with pytest.raises(ValueError, match="'graphs' is no group of bench; known are calls, storage"):
        bench.print_bench(bench.BenchOrder(only=('graphs',)), None)


@pytest.mark.slow
def test_the_stages_of_a_replayed_second_stand_beside_all_of_it(monkeypatch):
    monkeypatch.setattr(fleet, '_RECORDINGS', 1)
    monkeypatch.setattr(fleet, '_REPLAYS', 6)
    figures = fleet.fleet_figures(lambda _: None, seconds=4.0, rounds=1)
    whole = figures.pop('fleet')
    assert (whole.other_name, whole.other) == ('real time', 1.0)
    stages = [figures.pop(f'fleet_{name}') for name in ('open', 'beside', 'columns', 'control')]
    assert all(stage.other == whole.ours > 0.0 for stage in stages)
    assert set(figures) == {'fleet_workers'}
    assert figures['fleet_workers'].ratio > 0.0


def test_the_chain_of_empty_nodes_answers_and_leaves_no_process(domain):
    assert relay_in_turn(Place(domain), 1.0) > 0.0
    assert children(['engine_mount.cli.bench.relay']) == []


def test_time_and_memory_of_a_process_are_those_of_the_system():
    own = os.getpid()
    before, used = processor_time(own), time.process_time()
    while time.process_time() - used < 0.1:
        math.sqrt(2.0)
    assert processor_time(own) - before >= 0.05
    assert 1e6 < memory(own) < 1e11
