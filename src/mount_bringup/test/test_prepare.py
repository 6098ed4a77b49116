"""What is compiled ahead is what the nodes would compile."""

import os
import subprocess
import sys

_AFTER = """
from mount_bringup.prepare import prepare
from mount_control.node import MountControl
from mount_init.node import MountInit
from mount_ros.nodes.process import ros_context, transition
from ros_testing import compiled_so_far
from mount_sim.node import MountSim

prepare(scenarios=['motorway'], policies=['continuous_viscous'])
before = compiled_so_far()
with ros_context({domain}) as context:
    for kind in (MountSim, MountInit, MountControl):
        node = kind(context=context)
        transition(node.trigger_configure, node, 'node')
        node.close()
        node.destroy_node()
print(len(before), sorted(compiled_so_far() - before))
"""


def test_a_node_finds_everything_compiled_that_it_needs(domain):
    run = subprocess.run(
        [sys.executable, '-c', _AFTER.replace('{domain}', str(domain))],
        capture_output=True,
        text=True,
        check=True,
        env={**os.environ, 'PYTHONPATH': os.pathsep.join(sys.path)},
    )
    count, _, missing = run.stdout.strip().partition(' ')
    assert int(count) > 0
    assert missing == '[]'
