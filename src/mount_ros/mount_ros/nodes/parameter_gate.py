"""What may be set on a node when: everything before it is configured, then only what it takes at run time."""

import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any, NamedTuple

from rcl_interfaces.msg import SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter

from mount_ros.nodes.parameters import SIM_TIME_REFUSED, USE_SIM_TIME


class Change(NamedTuple):
    """A parameter before and after it was set."""

    old: Any
    new: Any


class ParameterGate:
    """Stands before the parameters that are declared after it; it is closed while the node is configured.

    Closed, it lets through changes of the parameters in `run_time` that `check` does not refuse by a
    `ValueError`, and hands them to `take` when they are set; `check` gets all values as they would be, {name:
    value}. Every other change is refused with the sentence that says when it can be made.
    """

    def __init__(
        self,
        node: Node,
        run_time: frozenset[str],
        check: Callable[[Mapping[str, Any]], None],
        take: Callable[[Mapping[str, Change]], None],
    ):
        self._node = node
        self._run_time = run_time
        self._check = check
        self._take = take
        self._foreign = frozenset(node.get_parameters_by_prefix(''))  # of rclpy itself, such as use_sim_time
        self._present: dict[str, Any] | None = None  # all values while the gate is closed
        self._holder: int | None = None  # the thread that makes a transition
        node.add_on_set_parameters_callback(self._judge)
        node.add_post_set_parameters_callback(self._pass_on)

    @contextmanager
    def held(self) -> Iterator[None]:
        """Let nothing through but what this thread sets: the node is amid a transition."""
        before, self._holder = self._holder, threading.get_ident()
        try:
            yield
        finally:
            self._holder = before

    def close(self) -> None:
        """From now on the node works with what its parameters are."""
        own = [name for name in self._node.get_parameters_by_prefix('') if name not in self._foreign]
        self._present = {name: self._node.get_parameter(name).value for name in own}

    def open(self) -> None:
        """Let everything through again; safe to call twice."""
        self._present = None

    def _judge(self, parameters: list[Parameter]) -> SetParametersResult:
        if any(parameter.name == USE_SIM_TIME and parameter.value for parameter in parameters):
            return SetParametersResult(successful=False, reason=SIM_TIME_REFUSED)
        if self._holder not in (None, threading.get_ident()):
            return SetParametersResult(successful=False, reason=self._amid_transition(parameters[0].name))
        changes = self._changes(parameters)
        fixed = [name for name in changes if name not in self._run_time]
        if fixed:
            return SetParametersResult(successful=False, reason=self._when(fixed[0]))
        try:
            if changes and self._present is not None:
                self._check({**self._present, **{name: change.new for name, change in changes.items()}})
        except ValueError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    def _pass_on(self, parameters: list[Parameter]) -> None:
        changes = self._changes(parameters)
        if changes and self._present is not None:
            self._present.update({name: change.new for name, change in changes.items()})
            self._take(changes)

    def _changes(self, parameters: list[Parameter]) -> dict[str, Change]:
        present = self._present or {}
        return {
            parameter.name: Change(present[parameter.name], parameter.value)
            for parameter in parameters
            if parameter.name in present and parameter.value != present[parameter.name]
        }

    def _amid_transition(self, name: str) -> str:
        return f'{name} cannot be set while {self._node.get_name()} is amid a transition: wait for its end'

    def _when(self, name: str) -> str:
        known = ', '.join(sorted(self._run_time)) or 'nothing'
        return (
            f'{name} can be set before configure: deactivate and clean up first; '
            f'what can be set at run time is {known}'
        )
