"""The processes of the graph: started with their parameters, watched, ended in order."""

import contextlib
import os
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import yaml

from mount_bringup.graph.nodes import RECORDER, GraphNode, GraphSettings, groups
from mount_ros.nodes.process import environment_of_children

NODES_OF_PROCESS = 'ENGINE_MOUNT_NODES'
"""The environment variable by which who did not start a process knows its nodes."""

_INTERRUPT_LIMIT = 10.0  # s, chosen: until a node that was asked to end is terminated
_TERMINATE_LIMIT = 3.0  # s, chosen: until it is killed
_RECORDER_SHARE = 0.5  # chosen: of the loop's priority; before all others, for what it misses is gone


class NodeProcess:
    """One process of the graph with the nodes that live in it; its output goes to a log file.

    It loads what it needs at once, and makes its nodes when it is told to `begin`.
    """

    def __init__(self, nodes: Sequence[GraphNode], settings: GraphSettings, folder: Path):
        self.nodes = tuple(nodes)
        self.name = ' + '.join(node.full_name for node in nodes)
        stem = '_'.join(node.full_name.replace('/', '_') for node in nodes)
        self.reported = False
        """Whether its end has been told."""
        self._settings = settings
        self._recording = recording_of(self.nodes, settings)
        self.log_file = folder / f'{stem}.log'
        parameter_file = folder / f'{stem}.yaml'
        parameter_file.write_text(parameter_text(self.nodes, settings))
        self._command = [sys.executable, '-c', _program(self.nodes, settings.namespace), '--ros-args']
        self._command += ['--params-file', str(parameter_file)]
        if settings.namespace and not any(node.mount for node in nodes):
            self._command += ['-r', f'__ns:=/{settings.namespace.strip("/")}']
        self._process = self._start()

    def _start(self) -> subprocess.Popen[bytes]:
        with self.log_file.open('ab') as log:
            return subprocess.Popen(
                self._command,
                stdin=subprocess.PIPE,
                stdout=log,
                stderr=subprocess.STDOUT,
                env={**os.environ, **_environment(self.nodes, self._settings)},
                start_new_session=True,  # Ctrl-C in the terminal goes to the supervisor alone
            )

    def begin(self) -> None:
        """Let it make its nodes."""
        assert self._process.stdin is not None
        self._process.stdin.close()

    @property
    def begun(self) -> bool:
        """Whether it was told to."""
        return self._process.stdin is None or self._process.stdin.closed

    def start_again(self) -> None:
        """Kill what is left of the process and start it with the same parameters; its log goes on."""
        self._process.kill()
        self._process.wait()
        self._process, self.reported = self._start(), False
        self.begin()

    @property
    def exit_code(self) -> int | None:
        """None while the process runs."""
        return self._process.poll()

    def last_words(self) -> str:
        """Return the last error line of the log, or its last line."""
        lines = [line for line in self.log_file.read_text(errors='replace').splitlines() if line.strip()]
        errors = [line for line in lines if '[ERROR]' in line or '[FATAL]' in line or 'Error: ' in line]
        return (errors or lines or ['(it said nothing)'])[-1]

    def ask_to_end(self) -> None:
        """Send SIGINT, to which a node answers by going to 0 A and ending with code 0."""
        if self.exit_code is None:
            self._process.send_signal(signal.SIGINT if self.begun else signal.SIGKILL)

    def wait(self) -> int:
        """Return the exit code; a node that does not end is terminated, then killed.

        Not a recorder while its recording grows: on a slow disk it may need long for what it holds.
        """
        for limit, harder in ((_INTERRUPT_LIMIT, signal.SIGTERM), (_TERMINATE_LIMIT, signal.SIGKILL)):
            written = -1
            while written < (written := self._written()):
                with contextlib.suppress(subprocess.TimeoutExpired):
                    return self._process.wait(limit)
            self._process.send_signal(harder)
        return self._process.wait()

    def _written(self) -> int:
        """Return how many bytes of recordings there are, 0 where it records none."""
        folder = self._recording
        files = folder.parent.glob(f'{folder.name}*/*') if folder is not None else ()
        return sum(file.stat().st_size for file in files)


def end_all(processes: list[NodeProcess], at_once: bool = False) -> list[str]:
    """End the nodes, last started first; return a sentence per unclean end.

    One after the other, so that none drives the coil without those that watch it, or `at_once`.
    """
    complaints = []
    told = [process for process in processes if process.reported or not process.begun]
    died = [process for process in processes if process.exit_code is not None]
    if at_once:
        for process in reversed(processes):
            process.ask_to_end()
    for process in reversed(processes):
        if not at_once:
            process.ask_to_end()
        begin = time.monotonic()
        code = process.wait()
        if code == 0 or process in told:
            continue
        when = 'before it was told to end' if process in died else f'after {time.monotonic() - begin:.1f} s'
        complaints.append(f'{process.name} ended with code {code} {when}: {process.last_words()}')
    return complaints


def recording_of(nodes: Sequence[GraphNode], settings: GraphSettings) -> Path | None:
    """Return the folder of the recording that one of `nodes` makes, None where none does."""
    uri = settings.parameters.get(RECORDER.name, {}).get('uri') if RECORDER in nodes else None
    return Path(str(uri)) if uri else None


def start_processes(nodes: Sequence[GraphNode], settings: GraphSettings, folder: Path) -> list[NodeProcess]:
    """Start the processes of `nodes` in order."""
    return [NodeProcess(group, settings, folder) for group in groups(nodes, settings.grouping)]


def node_environment(nodes: Sequence[GraphNode], priority: int) -> dict[str, str]:
    """Return what a process is told: its `nodes`, its starter, which is this process, and its priority."""
    share = _RECORDER_SHARE if RECORDER in nodes else 1.0
    given = environment_of_children(max(1, round(share * priority)) if priority else 0)
    return {**given, NODES_OF_PROCESS: ' '.join(node.full_name for node in nodes)}


def _environment(nodes: Sequence[GraphNode], settings: GraphSettings) -> dict[str, str]:
    own = node_environment(nodes, settings.priority)
    python = {'PYTHONUNBUFFERED': '1', 'PYTHONSAFEPATH': '1'}  # modules in the working directory are foreign
    return {**own, **python, 'ROS_DOMAIN_ID': str(settings.domain)}


def _program(nodes: Sequence[GraphNode], namespace: str) -> str:
    imports = '; '.join(f'from {node.package}.node import {node.class_name}' for node in dict.fromkeys(nodes))
    if any(node.mount for node in nodes):  # a namespace for each, which no remapping of ROS could tell apart
        creates = []
        for node in nodes:
            space = f'/{namespace.strip("/")}/{node.mount}'.replace('//', '/')
            creates.append(f'partial({node.class_name}, namespace={space!r})')
        classes, imports = ', '.join(creates), f'from functools import partial; {imports}'
    else:
        classes = ', '.join(node.class_name for node in nodes)
    run = 'from mount_ros.nodes.process import run_nodes'
    return f'{imports}; {run}; import sys; sys.stdin.read(); run_nodes([{classes}])'


def parameter_text(nodes: Sequence[GraphNode], settings: GraphSettings) -> str:
    """Return a parameter file of ROS for these nodes, whatever their namespace."""
    tables = {
        f'/**/{node.full_name}': {'ros__parameters': dict(settings.parameters.get(node.full_name, {}))}
        for node in nodes
    }
    return yaml.safe_dump(tables, sort_keys=True)
