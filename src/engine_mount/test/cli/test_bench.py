"""The bench: each figure beside its alternative, told as a ratio and in a file."""

import json

import psutil
import pytest
from ros_testing import free_domain
from typer.testing import CliRunner

from engine_mount.cli.bench import bench, chains
from engine_mount.cli.bench.bench import BenchOrder, Comparison
from engine_mount.cli.command import app


@pytest.fixture
def domain():
    with free_domain() as number:
        yield number


def test_figures_are_told_as_ratios_and_written(tmp_path, monkeypatch):
    rows = {
        'x': Comparison('a thing', 2e-6, 'another', 8e-6),
        'y': Comparison('growth', 1.0, 'none', 0.0, 'B'),
    }
    monkeypatch.setattr(bench, 'import_module', lambda name: type('Module', (), {'measure': lambda *_: rows}))
    file = tmp_path / 'figures.json'
    result = CliRunner().invoke(app, ['bench', '--only', 'calls', '--json', str(file)])
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
        bench.print_bench(BenchOrder(only=('graphs',)), None)


def test_the_chain_of_empty_nodes_answers_and_leaves_no_process(domain):
    run = chains.run_relay(BenchOrder(seconds=1.0, domain=domain), 'events')
    assert 0.0 < run.latency < run.latency_p99
    assert 0.0 < run.cpu < 2.0
    assert not [child for child in psutil.Process().children() if 'relay' in ' '.join(child.cmdline())]


@pytest.mark.slow
def test_single_calls_are_measured():
    figures = bench.measure_group('calls', BenchOrder(), lambda words: None)
    assert set(figures) == {'pack', 'unpack', 'decode', 'control', 'core', 'replay'}
    assert all(row.ours > 0.0 and row.other > 0.0 for row in figures.values())
