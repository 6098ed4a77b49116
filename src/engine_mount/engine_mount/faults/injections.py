"""How each fault comes into the graph: from the simulated electronics, by a signal, by another sender."""

import contextlib
import mmap
import os
import signal
import struct
import subprocess
import sys
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter
from std_srvs.srv import SetBool

from engine_mount.faults.graph import PATIENCE, GraphUnderTest, GraphUnderTestError

_INJECT = 'mount_sim/inject_fault'
_INTRUDER = 'engine_mount.faults.intruder'
_SHIM = Path(__file__).parent / 'shim'
SHIM_FILE = 'ENGINE_MOUNT_SHIM'
"""Environment variable: file of two int64, what the `shim` changes in the processes under test."""


class Injection(Protocol):
    """A fault that can be brought in and taken away; `prepare` does what takes time beforehand."""

    def prepare(self, graph: GraphUnderTest) -> None:
        """Make ready, while all is well."""

    def begin(self, graph: GraphUnderTest) -> None:
        """Bring the fault in, at once."""

    def end(self, graph: GraphUnderTest) -> None:
        """Take it away; safe where the graph has ended."""


class _Momentary:
    """A fault that needs no preparation and cannot be taken away."""

    def prepare(self, graph: GraphUnderTest) -> None:
        """Nothing takes time."""

    def end(self, graph: GraphUnderTest) -> None:
        """Nothing can be taken away."""


@dataclass(frozen=True)
class Simulated:
    """A fault of the simulated electronics, by its name there, and what stands behind the name."""

    text: str

    def prepare(self, graph: GraphUnderTest) -> None:
        """Tell the simulator which fault will be asked for."""
        refusal = refusal_of(graph, 'mount_sim', {'inject': self.text})
        if refusal:
            raise GraphUnderTestError(f'mount_sim does not know the fault {self.text!r}: {refusal}')
        graph.client(SetBool, _INJECT).wait_for_service(PATIENCE)

    def begin(self, graph: GraphUnderTest) -> None:
        self._ask(graph, wanted=True)

    def end(self, graph: GraphUnderTest) -> None:
        if 'mount_sim' in graph.nodes():
            self._ask(graph, wanted=False)

    def _ask(self, graph: GraphUnderTest, *, wanted: bool) -> None:
        answer = graph.call(SetBool, _INJECT, SetBool.Request(data=wanted))
        if wanted and (answer is None or not answer.success):
            said = 'nothing' if answer is None else answer.message
            raise GraphUnderTestError(f'mount_sim does not take the fault {self.text!r}: {said}')


class Killed:
    """The process of a node, or the supervisor's, gets a signal that ends it."""

    def __init__(self, node: str, number: int = signal.SIGKILL):
        self._node, self._number = node, number
        self._pid = 0

    def prepare(self, graph: GraphUnderTest) -> None:
        """Find the process."""
        self._pid = graph.process.pid if self._node == 'supervisor' else graph.nodes()[self._node].pid

    def begin(self, graph: GraphUnderTest) -> None:
        os.kill(self._pid, self._number)

    def end(self, graph: GraphUnderTest) -> None:
        """Nothing can be taken away."""


class Stopped(Killed):
    """The process of a node stands still until the fault is taken away."""

    def __init__(self, node: str):
        super().__init__(node, signal.SIGSTOP)

    def end(self, graph: GraphUnderTest) -> None:
        with contextlib.suppress(ProcessLookupError):  # somebody has ended it meanwhile
            os.kill(self._pid, signal.SIGCONT)


class Intruder:
    """Another process that sends what only the graph may send; `intruder.py` knows the kinds."""

    def __init__(self, kind: str):
        self.kind = kind
        self._process: subprocess.Popen[str] | None = None

    def prepare(self, graph: GraphUnderTest) -> None:
        """Start it and wait until it knows the graph; it is silent until it is told to send."""
        place = [self.kind, str(graph.domain), graph.namespace]
        process = subprocess.Popen(
            [sys.executable, '-P', '-m', _INTRUDER, *place],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        self._process = process
        assert process.stdout is not None
        if process.stdout.readline().strip() != 'ready':
            raise GraphUnderTestError(f'the intruder {self.kind} did not start')

    def begin(self, graph: GraphUnderTest) -> None:
        process = self._process
        assert process is not None
        assert process.stdin is not None
        process.stdin.write('go\n')
        process.stdin.flush()

    def end(self, graph: GraphUnderTest) -> None:
        process, self._process = self._process, None
        if process is not None:
            process.communicate()  # the end of its input ends it


@dataclass(frozen=True)
class ClockStep:
    """The clocks that the processes under test read step by `seconds`, and back when it is taken away."""

    seconds: float

    def prepare(self, graph: GraphUnderTest) -> None:
        """Nothing takes time: the graph was started with `shim_environment`."""

    def begin(self, graph: GraphUnderTest) -> None:
        _write_shim(graph.folder.parent, step=self.seconds)

    def end(self, graph: GraphUnderTest) -> None:
        _write_shim(graph.folder.parent)


@dataclass(frozen=True)
class ControlHangs(_Momentary):
    """One step of the control lasts longer by `seconds`."""

    seconds: float

    def begin(self, graph: GraphUnderTest) -> None:
        _write_shim(graph.folder.parent, hang=self.seconds)
        time.sleep(0.5 * self.seconds)  # by then a step has begun
        _write_shim(graph.folder.parent)


class Unchanged(_Momentary):
    """The fault came in with the start of the graph."""

    def begin(self, graph: GraphUnderTest) -> None:
        """It is there."""


@dataclass(frozen=True)
class ParametersSet(_Momentary):
    """Somebody sets parameters (node, name, value) to what makes no sense; each must be refused."""

    values: tuple[tuple[str, str, Any], ...]

    def begin(self, graph: GraphUnderTest) -> None:
        for node, name, value in self.values:
            refusal = refusal_of(graph, node, {name: value})
            if not refusal:
                raise NonsenseTakenError(f'{node} took {name} = {value!r}')
            graph.refusals.append(refusal)


Steps = tuple[tuple[str, int], ...]


@dataclass(frozen=True)
class Transitioned:
    """Somebody takes nodes through transitions (node, transition), and through others to end the fault."""

    there: Steps
    back: Steps = ()

    def prepare(self, graph: GraphUnderTest) -> None:
        """Find the services."""
        for node, _ in (*self.there, *self.back):
            graph.client(ChangeState, f'{node}/change_state').wait_for_service(PATIENCE)

    def begin(self, graph: GraphUnderTest) -> None:
        for node, transition in self.there:
            take_through(graph, node, transition)

    def end(self, graph: GraphUnderTest) -> None:
        for node, transition in self.back:
            take_through(graph, node, transition)


class NonsenseTakenError(RuntimeError):
    """A node took a parameter that it must refuse."""


def take_through(graph: GraphUnderTest, node: str, transition: int) -> bool:
    """Return whether a node went through a transition."""
    request = ChangeState.Request(transition=Transition(id=transition))
    answer = graph.call(ChangeState, f'{node}/change_state', request)
    return answer is not None and answer.success


def refusal_of(graph: GraphUnderTest, node: str, values: Mapping[str, Any]) -> str:
    """Set parameters of a node and return its refusal, empty if it took them."""
    wanted = [Parameter(name, value=value).to_parameter_msg() for name, value in values.items()]
    answer = graph.call(SetParameters, f'{node}/set_parameters', SetParameters.Request(parameters=wanted))
    if answer is None:
        return 'no answer'
    return '; '.join(each.reason for each in answer.results if not each.successful)


def shim_environment(folder: Path) -> dict[str, str]:
    """Return what a graph in `folder` needs in its environment for `ClockStep` and `ControlHangs`."""
    _write_shim(folder)
    paths = [str(_SHIM), *filter(None, [os.environ.get('PYTHONPATH')])]
    return {SHIM_FILE: str(_shim_file(folder)), 'PYTHONPATH': os.pathsep.join(paths)}


def _shim_file(folder: Path) -> Path:
    return folder / 'shim'


def _write_shim(folder: Path, *, step: float = 0.0, hang: float = 0.0) -> None:
    file = _shim_file(folder)
    if not file.exists():
        file.write_bytes(bytes(mmap.PAGESIZE))
    with file.open('r+b') as opened:
        opened.write(struct.pack('<qq', round(1e9 * step), round(1e9 * hang)))
