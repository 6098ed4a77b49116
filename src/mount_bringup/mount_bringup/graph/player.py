"""The process of `ros2 bag play` beside a launched control: it publishes recorded inputs by the wall clock.

The stamps in the messages are the recorded ones, and the control uses no other time: `/clock` and
`use_sim_time` are not needed.
"""

import shutil
import signal
import subprocess
import tempfile
from pathlib import Path

import yaml

from mount_bringup.graph.nodes import GraphError
from mount_ros.nodes.process import tied
from mount_ros.topics import AIR_GAP, CURRENT_FORCE_TABLE, DISPLACEMENT, Delivery, Topic

PLAYED = (DISPLACEMENT, AIR_GAP, CURRENT_FORCE_TABLE)
"""The inputs of the control. Recorded setpoints are not played: the control publishes its own."""

_DISCOVERY = 2.0  # s, chosen: until the first message, so that publishers are found before it
_END_LIMIT = 5.0  # s, chosen: until an interrupted player is killed


class Player:
    """Plays the inputs of the mount in `namespace` from a recording; `rate` 1: as fast as recorded.

    The player ends with this process, whatever ends that, and leaves no file behind.
    """

    def __init__(self, bag: Path, namespace: str, rate: float):
        self._offers = offers_text(namespace)
        self._command = play_command(bag, namespace, rate)
        self._process: subprocess.Popen[bytes] | None = None

    def begin(self) -> None:
        """Start to play."""
        if shutil.which(self._command[0]) is None:
            raise GraphError(f'{self._command[0]} cannot be started: it is not among the programs in PATH')
        with tempfile.TemporaryFile('w+') as offers:
            offers.write(self._offers)
            offers.seek(0)
            # a session of its own: Ctrl-C goes to the supervisor alone
            self._process = subprocess.Popen(tied(self._command), stdin=offers, start_new_session=True)

    @property
    def finished(self) -> bool:
        """Whether all was played; raises `GraphError` where the player failed."""
        code = None if self._process is None else self._process.poll()
        if code:
            raise GraphError(
                f'`{" ".join(self._command)}` ended with code {code}: it needs the packages ros2bag and '
                'rosbag2_storage_mcap; its output is above'
            )
        return code == 0

    def end(self) -> None:
        """End the player; safe to call twice."""
        if self._process is None or self._process.poll() is not None:
            return
        self._process.send_signal(signal.SIGINT)
        try:
            self._process.wait(_END_LIMIT)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()


def play_command(bag: Path, namespace: str, rate: float) -> list[str]:
    """Return the command that plays the inputs of a control in `namespace`; it reads `offers_text`."""
    return ['ros2', 'bag', 'play', str(bag), '--rate', f'{rate:g}', '--delay', f'{_DISCOVERY:g}',
            '--disable-keyboard-controls', '--qos-profile-overrides-path', '/dev/stdin',
            '--topics', *(_full_name(topic, namespace) for topic in PLAYED)]  # fmt: skip


def offers_text(namespace: str) -> str:
    """Return the quality of service of the latched topics, which not every recording holds, for rosbag2."""
    latched = {'reliability': 'reliable', 'durability': 'transient_local', 'history': 'keep_last', 'depth': 1}
    names = (_full_name(topic, namespace) for topic in PLAYED if topic.delivery is Delivery.LATCHED)
    return yaml.safe_dump({name: dict(latched) for name in names})


def _full_name(topic: Topic, namespace: str) -> str:
    return f'/{namespace.strip("/")}/{topic.name}'.replace('//', '/')
