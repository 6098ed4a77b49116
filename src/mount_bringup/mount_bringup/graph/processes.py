"""The processes of the graph: started with their parameters, watched, ended in order."""

import contextlib
import os
import signal
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import yaml

from mount_bringup.graph.nodes import RECORDER, GraphNode, GraphSettings, name_in
from mount_ros.nodes.process import environment_of_children

QUIET_START = 'import signal; signal.signal(signal.SIGINT, signal.SIG_DFL); '
"""The begin of a program: until it takes signals, SIGINT ends it at once and without a traceback."""

_INTERRUPT_LIMIT = 10.0  # s, chosen: until a node that does not end is terminated
_TERMINATE_LIMIT = 3.0  # s, chosen: until it is killed
_RECORDER_SHARE = 0.5  # chosen: of the loop's priority; before all others, for what it misses is gone


class NodeProcess:
    """One process of the graph with the nodes that live in it.

    `begun`: its nodes have been configured. `reported`: the user knows of its end.
    """

    def __init__(self, nodes: Sequence[GraphNode], settings: GraphSettings, folder: Path):
        self.nodes = tuple(nodes)
        self.name = ' + '.join(node.full_name for node in nodes)
        self.begun = False
        stem = self.name.replace('/', '_').replace(' + ', '_')
        self.log_file = folder / f'{stem}.log'
        self._settings = settings
        parameter_file = folder / f'{stem}.yaml'
        parameter_file.write_text(_parameter_text(nodes, settings))
        self._command = [
            *(sys.executable, '-c', _program(nodes, settings.namespace), '--ros-args'),
            *('--params-file', str(parameter_file), '--log-level', settings.log_level),
        ]
        self._process = self._start()

    def _start(self) -> subprocess.Popen[bytes]:
        self.reported = False
        with contextlib.ExitStack() as files:
            log = None if self._settings.log_to_screen else files.enter_context(self.log_file.open('ab'))
            return subprocess.Popen(
                self._command,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
                env={**os.environ, **_environment(self.nodes, self._settings)},
                start_new_session=True,  # Ctrl-C in the terminal goes to the supervisor alone
            )

    def start_again(self) -> None:
        """Kill what is left of the process and start it with the same parameters; its log goes on."""
        self._process.kill()
        self._process.wait()
        self._process = self._start()

    @property
    def exit_code(self) -> int | None:
        """None while the process runs."""
        return self._process.poll()

    def last_words(self) -> str:
        """Return the last line of the log, and where the log is."""
        if self._settings.log_to_screen:
            return 'see its log above'
        lines = [line for line in self.log_file.read_text(errors='replace').splitlines() if line.strip()]
        return f'{(lines or ["(its log is empty)"])[-1]} (log: {self.log_file})'

    def interrupt(self) -> None:
        """Send SIGINT: a node goes to 0 A and ends with code 0. One that does nothing yet is killed."""
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
        uri = self._settings.parameters.get(RECORDER.name, {}).get('uri') if RECORDER in self.nodes else None
        folder = Path(str(uri))
        files = folder.parent.glob(f'{folder.name}*/*') if uri else ()
        return sum(file.stat().st_size for file in files)


def end_processes(processes: Sequence[NodeProcess], *, at_once: bool) -> list[str]:
    """End processes, last started first; return a sentence per unclean end.

    One after the other, so that none drives the coil without those that watch it, or `at_once`.
    """
    known = [process for process in processes if process.reported or not process.begun]
    complaints = []
    for process in processes[::-1] if at_once else ():
        process.interrupt()
    for process in processes[::-1]:
        if not at_once:
            process.interrupt()
        code = process.wait()
        if code not in (0, -signal.SIGINT) and process not in known:  # -SIGINT: it was still loading
            complaints.append(f'{process.name} ended with code {code}: {process.last_words()}')
    return complaints


def _environment(nodes: Sequence[GraphNode], settings: GraphSettings) -> dict[str, str]:
    share = _RECORDER_SHARE if RECORDER in nodes else 1.0
    priority = max(1, round(share * settings.priority)) if settings.priority else 0
    # Modules in the working directory are foreign: an empty part of the path means it too.
    path = os.pathsep.join(filter(None, os.environ.get('PYTHONPATH', '').split(os.pathsep)))
    python = {'PYTHONUNBUFFERED': '1', 'PYTHONSAFEPATH': '1', 'PYTHONPATH': path}
    return {**environment_of_children(priority), **python, 'ROS_DOMAIN_ID': str(settings.domain)}


def _program(nodes: Sequence[GraphNode], namespace: str) -> str:
    """Return a program of Python; each node has a namespace, which no remapping of ROS could tell apart."""
    imports, creates = 'from functools import partial; ', []
    for node in nodes:
        space = '/' + name_in(namespace.strip('/'), node.mount).rstrip('/')
        imports += f'from {node.name}.node import {node.class_name}; '
        creates.append(f'partial({node.class_name}, namespace={space!r})')
    imports += 'from mount_ros.nodes.process import run_nodes; '
    return f'{QUIET_START}{imports}run_nodes([{", ".join(creates)}])'


def _parameter_text(nodes: Sequence[GraphNode], settings: GraphSettings) -> str:
    """Return a parameter file of ROS for these nodes, whatever their namespace."""
    tables = {
        f'/**/{node.full_name}': {'ros__parameters': dict(settings.parameters.get(node.full_name, {}))}
        for node in nodes
    }
    return yaml.safe_dump(tables)
