"""How each kind of fault comes into the graph: by the simulated electronics, a signal, another sender.

A kind is a generator of (graph, argument): what takes time comes before its `yield`, which gives the function
that injects the fault at once; what follows takes the fault away, safely also where the graph has ended.
"""

import contextlib
import mmap
import os
import signal
import struct
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rcl_interfaces.srv import SetParameters
from rclpy.parameter import Parameter
from std_srvs.srv import SetBool

from engine_mount.faults.case import FaultCase
from engine_mount.faults.graph import PATIENCE, GraphUnderTest, GraphUnderTestError

Injection = Iterator[Callable[[], object]]
Steps = Sequence[tuple[str, str]]
"""(node, transition) one after the other."""

SHIM_FILE = 'ENGINE_MOUNT_SHIM'
"""Environment variable: file of two int64, what the `shim` changes in the processes under test."""

_INJECT = 'mount_sim/inject_fault'


@contextlib.contextmanager
def injection(case: FaultCase, graph: GraphUnderTest) -> Injection:
    """Prepare a fault and give the function that injects it; it is taken away at the end of the block."""
    yield from _KINDS[case.kind](graph, case.argument)


def _simulated(graph: GraphUnderTest, fault: str) -> Injection:
    """A fault of the simulated electronics, by its name there."""
    if refusal := _refusal(graph, 'mount_sim', 'inject', fault):
        raise GraphUnderTestError(f'mount_sim does not know the fault {fault!r}: {refusal}')
    graph.client(SetBool, _INJECT).wait_for_service(PATIENCE)

    def begin() -> None:
        answer = graph.call(SetBool, _INJECT, SetBool.Request(data=True))
        if answer is None or not answer.success:
            reason = 'no answer' if answer is None else answer.message
            raise GraphUnderTestError(f'mount_sim does not take the fault {fault!r}: {reason}')

    try:
        yield begin
    finally:
        if 'mount_sim' in graph.nodes():
            graph.call(SetBool, _INJECT, SetBool.Request(data=False))


def _signal(number: int, graph: GraphUnderTest, node: str) -> Injection:
    """The process of a node, or the supervisor's, gets a signal; one that it stops is continued."""
    pid = graph.process.pid if node == 'supervisor' else graph.nodes()[node].pid
    try:
        yield partial(os.kill, pid, number)
    finally:
        if number == signal.SIGSTOP:
            with contextlib.suppress(ProcessLookupError):  # another process has ended it meanwhile
                os.kill(pid, signal.SIGCONT)


def _rogue_sender(graph: GraphUnderTest, kind: str) -> Injection:
    """Another process that sends what only the graph may send."""
    module = ['-m', 'engine_mount.faults.rogue_sender', kind, str(graph.domain), graph.namespace]
    process = subprocess.Popen(
        [sys.executable, '-P', *module], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert process.stdin is not None
    assert process.stdout is not None
    try:
        if process.stdout.readline().strip() != 'ready':
            raise GraphUnderTestError(f'the rogue sender {kind} did not start')
        yield partial(print, 'go', file=process.stdin, flush=True)
    finally:
        process.communicate()  # the end of its input ends it


def _clock_step(graph: GraphUnderTest, seconds: float) -> Injection:
    """The clocks that the processes under test read step by `seconds`, and back at the end."""
    try:
        yield partial(_write_shim, graph.folder.parent, step=seconds)
    finally:
        _write_shim(graph.folder.parent)


def _control_hang(graph: GraphUnderTest, seconds: float) -> Injection:
    """One step of the control lasts longer by `seconds`."""

    def begin() -> None:
        _write_shim(graph.folder.parent, hang=seconds)
        time.sleep(0.5 * seconds)  # by then a step has begun
        _write_shim(graph.folder.parent)

    yield begin


def _from_start(graph: GraphUnderTest, faults: Sequence[str]) -> Injection:
    """The fault came in with the start of the graph."""
    yield lambda: None


def _parameters(graph: GraphUnderTest, values: Sequence[tuple[str, str, Any]]) -> Injection:
    """Parameters (node, name, value) are set to what makes no sense; each must be refused."""

    def begin() -> None:
        for node, name, value in values:
            if not (refusal := _refusal(graph, node, name, value)):
                raise GraphUnderTestError(f'{node} took {name} = {value!r}')
            graph.refusals.append(refusal)

    yield begin


def _transitions(graph: GraphUnderTest, steps: Mapping[str, Steps]) -> Injection:
    """Nodes go through transitions `there`, and through others `back` to end the fault."""
    for node, _ in (*steps['there'], *steps['back']):
        graph.client(ChangeState, f'{node}/change_state').wait_for_service(PATIENCE)
    try:
        yield partial(change_states, graph, steps['there'])
    finally:
        change_states(graph, steps['back'])


_KINDS: Mapping[str, Callable[[GraphUnderTest, Any], Injection]] = {
    'simulated': _simulated,
    'killed': partial(_signal, signal.SIGKILL),
    'interrupted': partial(_signal, signal.SIGINT),
    'stopped': partial(_signal, signal.SIGSTOP),
    'rogue_sender': _rogue_sender,
    'clock_step': _clock_step,
    'control_hang': _control_hang,
    'from_start': _from_start,
    'parameters': _parameters,
    'transitions': _transitions,
}


def change_states(graph: GraphUnderTest, steps: Steps) -> None:
    """Take nodes through transitions, `activate` and others of `lifecycle_msgs`."""
    for node, name in steps:
        transition = Transition(id=getattr(Transition, f'TRANSITION_{name.upper()}'))
        graph.call(ChangeState, f'{node}/change_state', ChangeState.Request(transition=transition))


def _refusal(graph: GraphUnderTest, node: str, name: str, value: Any) -> str:
    """Set a parameter of a node and return its refusal, empty if it took it."""
    request = SetParameters.Request(parameters=[Parameter(name, value=value).to_parameter_msg()])
    answer = graph.call(SetParameters, f'{node}/set_parameters', request)
    if answer is None:
        return 'no answer'
    return '; '.join(each.reason for each in answer.results if not each.successful)


def shim_environment(folder: Path) -> dict[str, str]:
    """Return what a graph in `folder` needs in its environment for steps of clocks and hanging controls."""
    _write_shim(folder)
    paths = [str(Path(__file__).parent / 'shim'), *filter(None, [os.environ.get('PYTHONPATH')])]
    return {SHIM_FILE: str(folder / 'shim'), 'PYTHONPATH': os.pathsep.join(paths)}


def _write_shim(folder: Path, *, step: float = 0.0, hang: float = 0.0) -> None:
    file = folder / 'shim'
    if not file.exists():
        file.write_bytes(bytes(mmap.PAGESIZE))
    with file.open('r+b') as opened:
        opened.write(struct.pack('<qq', round(1e9 * step), round(1e9 * hang)))
