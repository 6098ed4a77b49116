"""The events in the graph of a drive, shown while it runs: a line for each."""

import re
import time
from collections.abc import Callable, Mapping, Sequence

from mount_bringup.graph.graph import GraphObserver
from mount_bringup.graph.nodes import DRIVER, INIT, RECORDER, GraphNode
from mount_recorder.automatic_marks import PAUSE, MarkKind, Ration, of_mount
from mount_ros.messages.event import BY_HAND, Mark
from mount_ros.nodes.diagnostics import Level

_STARTING, _ACTIVE = 'starting', 'active'
_NUMBERS = re.compile(r'[\d.]+')
_SETTLING = 1.0  # s, chosen: before that a node may rightly complain of one that is not yet active


def line(label: str, text: str) -> str:
    """Return a line of a drive: a label or a time, and the event."""
    return f'{label:<10} {text}'


class DriveEvents(GraphObserver):
    """Receives the events of the graph of `nodes`; `say` shows each line.

    Frequent events are rationed as the automatic marks are: ten lines of a kind, then one in 2 s, with the
    number of those left out. Times are in s from the first displacement sample.
    """

    def __init__(
        self,
        nodes: Sequence[GraphNode],
        say: Callable[[str], None],
        clock: Callable[[], float] = time.monotonic,
    ):
        self._say, self._clock = say, clock
        self._begin = clock()
        self._states = {node.full_name: _STARTING for node in nodes}
        self._active: float | None = None  # when all nodes were active, s on the clock
        self._zero: int | None = None  # stamp of the first sample, ns
        self._sentences: dict[str, str] = {}
        self._mounts = {node.mount for node in nodes if node.mount}
        self._damping: dict[str, int] = {}  # mount -> stamp of its last switch-on while it damps, ns
        self._times_on = 0
        self._rations: dict[str, Ration] = {}

    def begin(self) -> None:
        """Show which nodes there will be."""
        self._say(line(_STARTING, ', '.join(map(_short, self._states))))

    @property
    def states(self) -> str:
        """The states of all nodes, in one line."""
        names: dict[str, list[str]] = {}
        for name, state in self._states.items():
            names.setdefault(state, []).append(_short(name))
        return '; '.join(f'{state}: {", ".join(those)}' for state, those in names.items())

    @property
    def damping(self) -> str:
        """Whether a mount damps at this moment, in one line."""
        times = '' if self._times_on == 1 else f', switched on {self._times_on} times'
        return f'damping {"on" if self._damping else "off"}{times}' if self._times_on else 'no damping yet'

    def on_state(self, node: GraphNode, state: str) -> None:
        if self._states.get(node.full_name) == _ACTIVE:
            return  # a node that failed and was started again; the supervisor reports it
        self._states[node.full_name] = state
        if set(self._states.values()) == {_ACTIVE}:
            self._active = self._clock()
            self._say(line(_ACTIVE, f'all nodes, {self._active - self._begin:.1f} s after the start'))

    def on_report(self, name: str, figures: Mapping[str, str]) -> None:
        node = name.rpartition('/')[2]
        if node == DRIVER.name and self._zero is None:
            self._find_zero(figures)
        elif node == RECORDER.name:
            self._show_switching_off(figures)
        self._show_sentence(name, figures)

    def on_mark(self, mount: str, mark: Mark) -> None:
        for name in self._mounts:  # in a mark that the recorder of all sets
            if not mount and mark.text.startswith(of_mount(name)):
                mount, mark = name, mark._replace(text=mark.text.removeprefix(of_mount(name)))
        if mark.kind == MarkKind.SWITCH_ON.value:
            self._times_on += 1
            self._damping[mount] = mark.time
            self._show('damping', mount, mark.time, mark.text)
        elif mark.kind not in (BY_HAND, MarkKind.FAULT.value):  # faults come with the reports of the nodes
            self._show(mark.kind, mount, mark.time, mark.text)

    def _find_zero(self, figures: Mapping[str, str]) -> None:
        """Note the stamp of the first sample: the driver counts from there on."""
        if samples := _number(figures, 'samples'):
            steps = samples + _number(figures, 'lost') - 1
            self._zero = _number(figures, 'last_stamp') - round(steps * 1e9 / float(figures['sample_rate']))

    def _show_switching_off(self, figures: Mapping[str, str]) -> None:
        """Show at which sample the recorder saw damping go off, once the pause is long enough to be one."""
        for mount, began in list(self._damping.items()):
            off = _number(figures, f'damping_off.{mount}'.rstrip('.'))
            if off > began and _number(figures, 'last_stamp') - off >= PAUSE * 1e9:
                del self._damping[mount]
                self._show('damping', mount, off, 'damping off')

    def _show_sentence(self, name: str, figures: Mapping[str, str]) -> None:
        """Show the gap once, and each warning or error that begins or stands once all nodes are active."""
        before, sentence = self._sentences.get(name, ''), figures['sentence']
        mount, _, node = name.rpartition('/')
        if node == INIT.name and not before and 'contact_gap_um' in figures:
            self._sentences[name] = sentence
            self._say(line('gap', f'{of_mount(mount)}{sentence}'))
            return
        grave = int(figures['level']) >= Level.WARN
        settled = self._active is not None and self._clock() - self._active >= _SETTLING
        if grave and settled and _NUMBERS.sub('', sentence) != _NUMBERS.sub('', before):
            self._sentences[name] = sentence
            self._show(name, '', None, f'{_short(name)}: {sentence}')

    def _show(self, kind: str, mount: str, stamp: int | None, text: str) -> None:
        ration = self._rations.setdefault(kind, Ration(self._clock()))
        withheld = ration.take(self._clock())
        if withheld is None:
            return
        more = f'; {withheld} more since the line before' if withheld else ''
        label = 'warning' if stamp is None else ''
        if stamp is not None and self._zero is not None:
            label = f'{(stamp - self._zero) * 1e-9:8.2f} s'
        self._say(line(label, f'{of_mount(mount)}{text}{more}'))


def _short(name: str) -> str:
    return name.replace('mount_', '')


def _number(figures: Mapping[str, str], name: str) -> int:
    text = figures.get(name, '')
    return int(text) if text.lstrip('-').isdigit() else 0
