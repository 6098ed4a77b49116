"""The bench: each figure beside its alternative, told as a ratio and in a file."""

import json

import psutil
import pytest
from command_line import command

from engine_mount.cli.bench import BenchOrder, Comparison
from engine_mount.cli.bench.graph import run_relay
from engine_mount.cli.commands import bench


def test_figures_are_told_as_ratios_and_written(tmp_path, monkeypatch):
    rows = {
        'x': Comparison('a thing', 2e-6, 'another', 8e-6),
        'y': Comparison('growth', 1.0, 'none', 0.0, 'B'),
    }
    monkeypatch.setattr(bench, 'import_module', lambda name: type('Module', (), {'calls': lambda *_: rows}))
    printed = command('dev', 'bench', '--only', 'calls', '--json', tmp_path / 'figures.json')
    figures = json.loads((tmp_path / 'figures.json').read_text())
    assert figures['x'] == {
        'what': 'a thing', 'ours': 2e-6, 'other': 8e-6, 'beside': 'another', 'unit': 's', 'ratio': 0.25,
    }  # fmt: skip
    assert figures['y']['ratio'] is None
    assert '2.00 µs' in printed
    assert '0.25' in printed


def test_the_chain_of_empty_nodes_answers_and_leaves_no_process(domain, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / 'rclpy.py').write_text('raise SystemExit("foreign code ran")')
    run = run_relay(BenchOrder(1, 1.0, 1000.0, domain, 0))
    assert 0.0 < run.latency < run.latency_p99
    assert run.missing < 0.5
    assert not [child for child in psutil.Process().children() if 'relay' in ' '.join(child.cmdline())]


@pytest.mark.slow
def test_one_sample_is_measured_beside_real_time():
    assert 'ratio' in command('dev', 'bench', '--only', 'calls')
