"""Whatever ends a drive, the coil is at 0 A, the recording is closed and the exit code tells the reason."""

import contextlib
import itertools
import json
import os
import re
import signal

import psutil
import pytest
from ros_testing import wait_until

import engine_mount
from engine_mount.recordings.audit import audit
from engine_mount.recordings.losses import losses
from mount_bringup.graph.nodes import SIMULATED

LIMIT = 120.0  # s: other tests run at the same time, only a failure takes so long


def _nodes(parent: int) -> dict[str, psutil.Process]:
    """Return {node: process} of those that the command has started and that still run."""
    children = psutil.Process(parent).children() if psutil.pid_exists(parent) else ()
    found = {}
    for child in children:
        with contextlib.suppress(psutil.Error):  # it has just ended
            command = ' '.join(child.cmdline())
            found |= {node.name: child for node in SIMULATED if f'from {node.name}.node' in command}
    return found


@pytest.mark.slow
@pytest.mark.real_time
def test_ctrl_c_during_the_start_ends_every_node(endless_drive, bus_listener):
    process, out = endless_drive()
    wait_until(lambda: (out / 'log' / 'mount_control.log').exists(), 'the start of all nodes', LIMIT)
    _interrupt(process)
    assert not bus_listener or bus_listener[-1].current == 0.0


@pytest.mark.real_time
def test_ctrl_c_during_the_initialisation_ends_at_zero_current_with_a_closed_recording(
    endless_drive, bus_listener
):
    process, out = endless_drive()
    wait_until(lambda: any(setpoint.current > 1.0 for setpoint in bus_listener), 'the ramp', LIMIT)
    _interrupt(process)
    _expect_a_sound_end(bus_listener, out)


@pytest.mark.slow
@pytest.mark.real_time
def test_a_second_graph_on_the_domain_is_refused_and_ctrl_c_ends_the_first_while_it_damps(
    endless_drive, command, bus_listener, domain
):
    first, out = endless_drive()
    wait_until(lambda: bus_listener, 'the first graph', LIMIT)
    second = command.drive('--scenario', 'bench', '--duration', '1')
    assert second.code == 1
    assert f'a graph already runs in ROS domain {domain}' in second.output
    wait_until(lambda: _damping(bus_listener), 'damping', LIMIT)
    _interrupt(first)
    _expect_a_sound_end(bus_listener, out)


@pytest.mark.slow
@pytest.mark.real_time
def test_death_of_the_control_node_ends_the_drive_and_names_it(endless_drive, bus_listener):
    process, out = endless_drive()
    wait_until(lambda: _damping(bus_listener), 'damping', LIMIT)
    os.kill(_nodes(process.pid)['mount_control'].pid, signal.SIGKILL)
    output, _ = process.communicate(timeout=LIMIT)
    assert process.returncode == 1
    assert 'mount_control ended with code -9' in output
    assert bus_listener[-1].current == 0.0
    assert len(engine_mount.open(out / 'recording')['displacement']) > 1000


@pytest.mark.slow
@pytest.mark.real_time
def test_nodes_end_when_their_supervisor_is_killed(endless_drive, bus_listener):
    process, _ = endless_drive()
    wait_until(lambda: len(bus_listener) > 100, 'setpoints', LIMIT)
    nodes = _nodes(process.pid)
    assert len(nodes) == 5
    process.kill()
    process.communicate(timeout=LIMIT)
    wait_until(lambda: not any(node.is_running() for node in nodes.values()), 'the end of all nodes', LIMIT)
    assert bus_listener[-1].current == 0.0


@pytest.mark.slow
@pytest.mark.real_time
def test_a_control_that_stands_still_costs_answers_the_coil_goes_to_0_ampere_and_the_drive_says_so(
    command, bus_listener, repeat_if_late
):
    repeat_if_late(lambda: _drive_with_a_control_that_stands_still(command, bus_listener))


def _drive_with_a_control_that_stands_still(command, bus_listener) -> str:
    """Return the output of a drive for which the machine was too late, else empty."""
    process, out = command.start_drive(
        '--scenario', 'bench', '--duration', '8', '--set', 'mount_sim.timeline.start=4', '--no-report',
        '--priority', '0',
    )  # fmt: skip
    wait_until(lambda: _damping(bus_listener) or process.poll() is not None, 'damping', LIMIT)
    nodes = _nodes(process.pid)
    if 'mount_control' not in nodes:
        return process.communicate()[0]
    os.kill(nodes['mount_control'].pid, signal.SIGSTOP)
    try:
        wait_until(lambda: bus_listener[-1].current == 0.0, '0 A', LIMIT)
        seen = len(bus_listener)
        wait_until(lambda: len(bus_listener) >= seen + 25, '0.5 s of 0 A every 20 ms', LIMIT)
        assert {setpoint.current for setpoint in bus_listener[seen:]} == {0.0}
    finally:
        os.kill(nodes['mount_control'].pid, signal.SIGCONT)
    output, _ = process.communicate(timeout=LIMIT)
    if 'too late for setpoints' in output:  # then what stood still may not have been active yet
        return output
    assert process.returncode == 1, output
    figures = json.loads((out / 'summary.json').read_text())
    # Of 500; the last 100 wait in the queue and are answered late.
    assert figures['unanswered_samples'] > 300, output
    assert figures['late_samples'] > 0
    assert any('the coil went to 0 A' in fault['sentence'] for fault in figures['faults'])
    recording = engine_mount.open(out / 'recording')
    found = losses(recording, audit(recording)).as_json()
    assert found == {name: figures[name] for name in found}
    assert f'samples unanswered: {figures["unanswered_samples"]} of ' in output
    return ''


@pytest.mark.slow
def test_lockstep_ends_with_an_error_where_a_sample_is_not_answered(command):
    result = command.drive(
        '--lockstep', '--scenario', 'bench', '--duration', '5',
        '--set', 'mount_sim.answer_patience=2.0',
        '--fault', 'can_silent@4:0.5',
    )  # fmt: skip
    assert result.code == 1
    assert 'was not answered within 2 s' in result.output
    assert len(engine_mount.open(result.folder / 'recording')['displacement']) == 4000


@pytest.mark.slow
@pytest.mark.parametrize(
    ('fault', 'sentence'),
    [
        ('coil_half', r'coil switched off: coil current \(0\.\d+ A\) must lie within .* about its setpoint'),
        (
            'temperature_250',
            r'coil temperature \(250\.0 degC\) must not exceed 180 degC: let the coil cool down',
        ),
    ],
)
def test_a_coil_at_fault_is_switched_off_and_ends_a_run_in_lock_step(command, fault, sentence):
    result = command.drive(
        '--lockstep', '--scenario', 'bench', '--duration', '3',
        '--fault', f'{fault}@5.2',
    )  # fmt: skip
    assert result.code == 1
    assert re.search(rf'mount_driver: .*{sentence}', result.output)
    sent = engine_mount.open(result.folder / 'recording')['current_setpoint']
    assert 5200 < len(sent) < 5400


def _interrupt(process) -> None:
    process.send_signal(signal.SIGINT)
    output, _ = process.communicate(timeout=LIMIT)
    assert process.returncode == 130, output
    assert 'interrupted' in output
    wait_until(lambda: not _nodes(process.pid), 'the end of all nodes', LIMIT)


def _expect_a_sound_end(setpoints, out) -> None:
    assert setpoints[-1].current == 0.0
    assert not setpoints[-1].enable
    recording = engine_mount.open(out / 'recording')
    assert recording.warnings == []
    assert len(recording['displacement']) > 100


def _damping(setpoints) -> bool:
    """Whether the control node has the coil on: its current has peak after peak, a ramp has one."""
    recent = [setpoint.current for setpoint in setpoints[-300:]]
    steps = [after - before for before, after in itertools.pairwise(recent) if after != before]
    peaks = sum(before > 0.0 > after for before, after in itertools.pairwise(steps))
    return len(recent) == 300 and min(recent) > 0.4 and peaks >= 3
