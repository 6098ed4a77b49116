"""The graph under test: the command `engine-mount drive` as a process, and what it leaves behind."""

import contextlib
import os
import signal
import subprocess
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import psutil
from rclpy.client import Client
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

from engine_mount.faults.observers import Report, observers, since
from mount_bringup.graph.domain import can_port, domain_lock
from mount_bringup.graph.nodes import CONTROL, SIM, SIMULATED
from mount_models.quantity import ParameterError

PATIENCE = 30.0  # s, chosen: for what happens in a second or two on a machine that is not busy
SHARED_MEMORY = Path('/dev/shm')
START_PATIENCE = 90.0  # s, chosen: a first start may compile the laws
LOOK_PERIOD = 0.005  # s
TIED = ('setpriv', '--pdeathsig', 'KILL')
"""Words before a command by which the kernel ends it with the process that starts it (util-linux)."""
_SETTLED = 0.3  # s, chosen: of current without a break counts as damping
_TRACEBACK = 'Traceback (most recent call last)'
_CODES = (0, 1, 130, -9)  # of `drive`: nothing wrong, something wrong, interrupted, killed
_DRIVE = (
    '--scenario', 'bench', '--duration', '600', '--no-report',
    '--restarts', '90',  # each fault is one of its own
    '--set', 'mount_sim.timeline.start=3.2',  # chosen: the initialisation takes 3 s of rest
)  # fmt: skip


class GraphUnderTestError(RuntimeError):
    """The graph under test did not come to the state in which a fault can be tried; the text says which."""


class Place(NamedTuple):
    """Where graphs under test run, and how they are started: `drive` is the command with its first words."""

    drive: tuple[str, ...]
    domain: int
    folder: Path
    priority: int = 0


class GraphUnderTest:
    """One graph, from its start to its end; observed from outside."""

    def __init__(
        self,
        place: Place,
        context: Context,
        namespace: str,
        options: Sequence[str],
        environment: Mapping[str, str],
    ):
        self.namespace, self.domain = namespace, place.domain
        self.folder = place.folder / namespace
        self.refusals: list[str] = []
        self._stack = contextlib.ExitStack()
        port = can_port(place.domain, namespace)
        self.observed = self._stack.enter_context(observers(context, namespace, port))
        self._operator = Node(
            'operator', namespace=namespace, context=context, start_parameter_services=False
        )
        self._stack.callback(self._operator.destroy_node)
        self._executor = SingleThreadedExecutor(context=context)
        self._executor.add_node(self._operator)
        self._stack.callback(self._executor.shutdown)
        self._clients: dict[str, Client] = {}
        self._shared: set[str] = set()
        self._of_others = set(os.listdir(SHARED_MEMORY))
        self._processes: set[psutil.Process] = set()
        command = [*place.drive, *_DRIVE, '--out', str(self.folder), '--namespace', namespace]
        command += ['--domain', str(place.domain), '--priority', str(place.priority), *options]
        self._log = place.folder / f'{namespace}.log'
        with self._log.open('wb') as log:
            self.process = subprocess.Popen(
                [*TIED, *command],
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                env={**os.environ, 'COLUMNS': '400', 'NO_COLOR': '1', **environment},
                start_new_session=True,
            )

    @property
    def ended(self) -> bool:
        """Whether the command has ended, and every process that it was known to have."""
        return self.process.poll() is not None and not self._running()

    def outputs(self) -> dict[str, str]:
        """Return {who: what it has printed}; not of the simulator, which tells what it was asked for."""
        return {name: text for name, text in self._texts().items() if name != SIM.name}

    def nodes(self) -> dict[str, psutil.Process]:
        """Return {node: process} of those that the command has started and that still run."""
        return {
            node.name: each
            for each in _family(self.process.pid)
            for node in SIMULATED
            if f'from {node.name}.node' in _command(each)
        }

    def is_damping(self) -> bool:
        """Whether control is active, and has made the coil carry current without a break for a while."""
        if CONTROL.name not in self.observed.active:
            return False
        begin, enough = time.monotonic() - _SETTLED, 0.8 * 1e3 * _SETTLED
        setpoints, truths = since(self.observed.setpoints, begin), since(self.observed.truths, begin)
        if min(len(setpoints), len(truths)) <= enough:
            return False
        return min(each.current for each in setpoints) > 0.0 and truths[-1].followed > 0.0

    def wait_until(self, condition: Callable[[], bool], limit: float) -> bool:
        """Return whether `condition` came true within `limit` s; it cannot once the graph has ended."""
        end = time.monotonic() + limit
        while not condition():
            if time.monotonic() > end or self.ended:
                return False
            time.sleep(LOOK_PERIOD)
        return True

    def wait_for_damping(
        self, reports_fault: Callable[[Report], bool], limit: float = START_PATIENCE
    ) -> None:
        """Return when it damps, nothing is wrong and no node reports what `reports_fault` picks.

        What an earlier fault has left in a verdict would pass for a report of the next one. Raises
        `GraphUnderTestError` after `limit` s.
        """
        if not self.wait_until(lambda: self.is_damping() and self.observed.is_quiet(reports_fault), limit):
            what = 'has ended' if self.ended else f'does not damp without complaint within {limit:g} s'
            last = ' '.join(self._texts()['supervisor'][-300:].split())
            raise GraphUnderTestError(f'the graph {what}: {last}')
        self._note_what_it_holds()

    def call(self, kind: Any, service: str, request: Any) -> Any:
        """Return the answer of a service of the graph, None if there is none."""
        client = self.client(kind, service)
        if not self.wait_until(client.service_is_ready, PATIENCE):
            return None
        answer = client.call_async(request)
        self._executor.spin_until_future_complete(answer, timeout_sec=PATIENCE)
        return answer.result() if answer.done() else None

    def client(self, kind: Any, service: str) -> Client:
        """Return the client of a service; made once, for it takes time until the service is found."""
        if service not in self._clients:
            self._clients[service] = self._operator.create_client(kind, service)
        return self._clients[service]

    def end(self) -> list[str]:
        """End it as Ctrl-C does, if it has not ended by itself; return what its end shows to be wrong."""
        with self._stack:
            if not self.ended:
                self._note_what_it_holds()
                self.process.send_signal(signal.SIGINT)
            try:
                code = self.process.wait(2 * PATIENCE)
            except subprocess.TimeoutExpired:
                self.process.kill()
                code = self.process.wait()
            last = time.monotonic() + PATIENCE
            while self._running() and time.monotonic() < last:
                time.sleep(LOOK_PERIOD)
            wrong = [f'left behind: {thing}' for thing in self._left_behind()]
            for process in self._running():
                process.kill()  # ours, and it would disturb all that follows
        wrong += [f'traceback of {name}' for name, text in self._texts().items() if _TRACEBACK in text]
        if code not in _CODES:
            wrong.append(f'the command ended with code {code}')
        return wrong

    def _texts(self) -> dict[str, str]:
        """Return {who: what it has printed}, of the command and its nodes."""
        files = {'supervisor': self._log, **{file.stem: file for file in self.folder.glob('log/*.log')}}
        return {name: file.read_text(errors='replace') for name, file in files.items()}

    def _note_what_it_holds(self) -> None:
        """Remember its processes and the files of shared memory that they hold."""
        for process in _family(self.process.pid):
            self._processes.add(process)
            self._shared |= _shared_memory(process)

    def _running(self) -> list[psutil.Process]:
        return [each for each in self._processes if runs(each)]

    def _left_behind(self) -> list[str]:
        """Return its processes, files of shared memory and locks that are still there."""
        left = [f'process {each.pid}: {_command(each):.80}' for each in self._running()]
        files = {name for name in self._shared - self._of_others if (SHARED_MEMORY / name).exists()}
        if files:  # the middleware of other graphs takes up what one has left
            for process in psutil.process_iter():
                files -= _shared_memory(process) if process.pid != os.getpid() else set()
        left += [str(SHARED_MEMORY / name) for name in sorted(files)]
        try:
            with domain_lock(self.domain, self.namespace):
                pass
        except ParameterError as error:
            left.append(str(error))
        return left


def _family(pid: int) -> list[psutil.Process]:
    """Return a process and all that it has started, those that have these, and so on, that still run."""
    try:
        process = psutil.Process(pid)
        return [each for each in (process, *process.children(recursive=True)) if runs(each)]
    except psutil.NoSuchProcess:
        return []


def runs(process: psutil.Process) -> bool:
    """Return whether it still runs; a zombie does not, nor a later process of the same number."""
    try:
        return process.is_running() and process.status() != psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return False


def _command(process: psutil.Process) -> str:
    """Return its command line, empty when it has ended."""
    try:
        return ' '.join(process.cmdline())
    except psutil.Error:
        return ''


def _shared_memory(process: psutil.Process) -> set[str]:
    """Return the names of the files of shared memory that it has mapped."""
    try:
        paths = [Path(each.path.removesuffix(' (deleted)')) for each in process.memory_maps()]
    except psutil.Error:
        return set()
    return {path.name for path in paths if path.parent == SHARED_MEMORY}
