"""One engine on two mounts through the whole graph: each under its own name, as in core."""

import pytest

import engine_mount

OPTIONS = ('--mounts', 'left,right', '--duration', '1.2', '--set', 'mount_sim.timeline.start=2.9')
OWN = ('--set', 'mount_sim.motorway.gap_time=0.2', '--set', 'mount_sim.mount_right.friction.scale=0.8')


@pytest.mark.slow
def test_two_mounts_give_the_same_in_lockstep_and_in_core_to_the_bit(command):
    lockstep, core = (command.drive(mode, *OPTIONS, *OWN) for mode in ('--lockstep', '--core'))
    recordings = [engine_mount.open(result.folder / 'recording') for result in (lockstep, core)]
    for mount in ('left', 'right'):
        of_graph, of_core = (recording.of_mount(mount) for recording in recordings)
        for topic, scalar in (
            ('displacement', 'mount'),
            ('current_setpoint', 'coil_current'),
            ('control_trace', 'desired_force'),
            ('sim/truth', 'friction_force'),
        ):
            count = len(of_core[topic].stamps)
            assert count > 1000, topic
            assert of_graph[topic][scalar][:count].tobytes() == of_core[topic][scalar].tobytes(), topic
    left, right = (recordings[0].of_mount(mount)['sim/truth'] for mount in ('left', 'right'))
    assert (left['displacement'] != right['displacement']).any()
    figures = lockstep.figures
    assert set(figures['mounts']) == {'left', 'right'}
    assert all(each['lost_samples'] == each['unanswered_samples'] == 0 for each in figures['mounts'].values())
    assert figures['mounts']['left']['rest_gap_m'] != figures['mounts']['right']['rest_gap_m']


def test_what_names_no_mount_is_refused_before_anything_starts(command):
    for option, words in (
        (('--fault', 'front/coil_half@3'), 'names no mount: known are left, right'),
        (('--set', 'front/mount_control.highest_current=2'), 'is no node of this graph'),
        (('--set', 'mount_sim.mount_left.seed=2'), 'is common to all mounts'),
    ):
        result = command.drive('--core', *OPTIONS, *option)
        assert result.code != 0
        assert words in ' '.join(result.output.split()), result.output
