"""The example of the README is a node that works."""

import re
from pathlib import Path

from ros_testing import wait_until

from mount_ros.data_path import DataPath
from mount_ros.messages.scalars import ScalarsLayout
from mount_ros.nodes.diagnostics import Level
from mount_ros.topics import DISPLACEMENT

README = Path(__file__).resolve().parents[1] / 'README.md'


def test_the_example_node_warns_of_what_it_watches(context, serve):
    example = {'__name__': 'example'}
    exec(re.search(r'```python\n(.*?)```', README.read_text(), re.DOTALL)[1], example)
    watch = example['PeakWatch'](context=context)
    serve(watch)
    try:
        watch.trigger_configure()
        watch.trigger_activate()
        assert watch.active
        source = DataPath(watch, lockstep=True)
        send = source.sender(DISPLACEMENT)
        wait_until(lambda: not source.unmatched() and not watch.data_path.unmatched(), 'connection')
        assert watch.judge().level is Level.OK
        send(ScalarsLayout(DISPLACEMENT).pack(1, (-0.012,)))
        wait_until(lambda: watch.judge().level is Level.WARN, 'the warning')
        assert watch.judge().sentence == 'peak 0.0120 m above 0.01 m; slow down'
        source.stop()
    finally:
        watch.close()
