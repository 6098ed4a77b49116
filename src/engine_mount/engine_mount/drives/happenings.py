"""Tells what happens in the graph of a drive while it happens, a line for each event."""

import re
import time
from collections.abc import Callable, Iterator, Mapping, Sequence

from mount_bringup.graph.nodes import CONTROL, DRIVER, INIT, RECORDER, GraphNode
from mount_bringup.graph.reports import GraphObserver
from mount_recorder.automatic_marks import MarkKind, Ration, of_mount
from mount_ros.messages.event import BY_HAND, Mark
from mount_ros.nodes.diagnostics import Level
from mount_ros.topics import DISPLACEMENT

_STARTING, _ACTIVATING = 'starting', 'activating'
_NAMED = 5  # chosen: more nodes are counted
_NUMBERS = re.compile(r'[\d.]+')
_SETTLING = 1.0  # s, chosen: before that a node may rightly complain of one that is not yet active
_MISSING = {DRIVER.name: 'lost', CONTROL.name: 'bridged'}


def line(label: str, text: str) -> str:
    """Return a line of a drive: a label or a time, and what is to be told."""
    return f'{label:<10} {text}'


class Happenings(GraphObserver):
    """Takes what the nodes tell; `say` takes each line.

    What happens often is rationed as the automatic marks are: ten lines of a kind, then one in 2 s, with the
    number of those left out. Times are in s from the first displacement sample.
    """

    def __init__(
        self,
        nodes: Sequence[GraphNode],
        say: Callable[[str], None],
        clock: Callable[[], float] = time.monotonic,
    ):
        self._say = say
        self._clock = clock
        self._begin = clock()
        self._states = {node.full_name: _STARTING for node in nodes}
        self._active: float | None = None  # when all nodes were active, s on the clock
        self._zero: int | None = None
        self._sentences: dict[str, str] = {}
        self._mounts = {node.mount for node in nodes if node.mount}
        self._damping: dict[str, int] = {}  # mount -> stamp since which it damps, ns
        self._times_on = 0
        self._lost = 0  # messages, by the recorder
        self._missing: dict[str, dict[str, int]] = {}  # mount -> samples that are missing, by whom
        self._rations: dict[str, Ration] = {}

    def begin(self) -> None:
        """Tell which nodes there will be."""
        self._say(line('starting', ', '.join(map(_short, self._states))))

    @property
    def states(self) -> str:
        """The states of all nodes, in one line."""
        names: dict[str, list[str]] = {}
        for name, state in self._states.items():
            names.setdefault(state, []).append(_short(name))
        few = len(self._states) <= _NAMED
        return '; '.join(
            f'{state}: {", ".join(those) if few or state == _ACTIVATING else len(those)}'
            for state, those in names.items()
        )

    @property
    def present(self) -> str:
        """Damping and losses at this moment, in one line."""
        times = '' if self._times_on == 1 else f', switched on {self._times_on} times'
        damping = f'damping {"on" if self._damping else "off"}{times}' if self._times_on else 'no damping yet'
        lost = self._lost + sum(max(counts.values()) for counts in self._missing.values())
        return f'{damping}; {f"{lost} samples or messages lost" if lost else "nothing lost"}'

    def on_state(self, node: GraphNode, state: str) -> None:
        if self._states.get(node.full_name) == 'active':
            return  # a node that was lost and came back; the supervisor tells of it
        self._states[node.full_name] = state
        if all(word == 'active' for word in self._states.values()):
            self._active = self._clock()
            self._say(line('active', f'all nodes, {self._clock() - self._begin:.1f} s after the start'))

    def on_report(self, name: str, figures: Mapping[str, str]) -> None:
        mount, _, node = name.rpartition('/')
        if node == DRIVER.name:
            self._find_zero(figures)
        elif node == CONTROL.name and figures.get('damping_active') == 'False':
            self._end_damping(mount, figures.get('last_stamp', ''))
        if node in _MISSING:
            self._note_missing(mount, node, figures.get(_MISSING[node], ''))
        elif node == RECORDER.name:
            self._lost = _number(figures.get('lost', ''))
            for topic, count in _missing_displacements(figures):
                self._note_missing(next((m for m in self._mounts if f'/{m}/' in topic), mount), node, count)
        self._tell_sentence(name, node, figures)

    def on_mark(self, mount: str, mark: Mark) -> None:
        for name in self._mounts:  # in a mark that the recorder of all sets
            if not mount and mark.text.startswith(of_mount(name)):
                mount, mark = name, mark._replace(text=mark.text.removeprefix(of_mount(name)))
        if mark.kind == MarkKind.SWITCH_ON.value:
            self._times_on += 1
            self._damping[mount] = mark.time
            self._tell('damping', mount, mark.time, mark.text)
        elif mark.kind not in (BY_HAND, MarkKind.FAULT.value):  # what nodes say comes from themselves
            self._tell(mark.kind, mount, mark.time, mark.text)

    def _find_zero(self, figures: Mapping[str, str]) -> None:
        """Note the stamp of the first sample: the driver counts from there on."""
        samples, last = _number(figures.get('samples', '')), _number(figures.get('last_stamp', ''))
        if self._zero is None and samples:
            steps = samples + _number(figures.get('lost', '')) - 1
            self._zero = last - round(steps * 1e9 / float(figures['sample_rate']))

    def _note_missing(self, mount: str, teller: str, count: str) -> None:
        """Note what one of the nodes misses; a sample that is lost on its way all behind it miss too."""
        self._missing.setdefault(mount, {})[teller] = _number(count)

    def _end_damping(self, mount: str, stamp: str) -> None:
        if _number(stamp) > self._damping.get(mount, _number(stamp)):
            del self._damping[mount]
            self._tell('damping', mount, _number(stamp), 'damping off')

    def _tell_sentence(self, name: str, node: str, figures: Mapping[str, str]) -> None:
        """Tell the gap once, and each warning or error that begins or stands once all nodes are active."""
        before, sentence = self._sentences.get(name, ''), figures['sentence']
        grave = int(figures['level']) >= Level.WARN
        if node == INIT.name and not before and 'contact_gap_um' in figures:
            self._sentences[name] = sentence
            self._say(line('gap', f'{of_mount(name.rpartition("/")[0])}{_gaps(figures)}'))
        settled = self._active is not None and self._clock() - self._active >= _SETTLING
        if grave and settled and _NUMBERS.sub('', sentence) != _NUMBERS.sub('', before):
            self._sentences[name] = sentence
            self._tell(name, '', None, f'{_short(name)}: {sentence}')

    def _tell(self, kind: str, mount: str, stamp: int | None, text: str) -> None:
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


def _missing_displacements(figures: Mapping[str, str]) -> Iterator[tuple[str, str]]:
    """Yield topic and number of the samples that are missing between the stamps that the recorder saw."""
    for name, count in figures.items():
        kind, _, topic = name.partition('.')
        if kind == 'missing' and topic.endswith(f'/{DISPLACEMENT.name}'):
            yield topic, count


def _gaps(figures: Mapping[str, str]) -> str:
    """Return what was found, short enough for a line of 80 columns."""
    rest, contact = (
        ' ± '.join(f'{float(figures[f"{name}_{part}"]):.1f}' for part in ('gap_um', 'gap_std_um'))
        for name in ('rest', 'contact')
    )
    offset = float(figures['offset_current_A'])
    return f'rest {rest} µm, contact {contact} µm, offset current {offset:.2f} A'


def _number(text: str) -> int:
    return int(text) if text.lstrip('-').isdigit() else 0
