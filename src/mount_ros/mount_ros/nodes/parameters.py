"""Node parameters declared from parameter sets: unit, sentence and range travel with the value."""

import contextlib
import math
import threading
from array import array
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any, NamedTuple, TypeVar, get_type_hints

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor, SetParametersResult
from rclpy.exceptions import ParameterException
from rclpy.node import Node
from rclpy.parameter import Parameter

from mount_models.quantity import (
    ParameterError,
    Quantity,
    check_name,
    flattened,
    quantities,
    with_flattened,
)
from mount_ros.private_rclpy import OpenLifecycleNode, given_at_start, integer_as_float

P = TypeVar('P', bound=NamedTuple)

USE_SIM_TIME = 'use_sim_time'
SIM_TIME_REFUSED = (
    'use_sim_time must be false: the stamps of the messages are the time of this graph, also of one that is '
    'played back, and its watches go by the steady clock; /clock is not needed'
)
"""Why a node takes no time from `/clock`."""


def declare(node: Node, defaults: NamedTuple, prefix: str = '', only: Collection[str] | None = None) -> None:
    """Declare every field of the parameter set `defaults` on `node`; nested ones as `outer.inner`.

    With `only` no others than these fields.
    """
    notes = quantities(defaults)
    kinds = get_type_hints(type(defaults))
    for name, value in defaults._asdict().items():
        full = f'{prefix}.{name}' if prefix else name
        if only is not None and name not in only:
            continue
        if hasattr(value, '_asdict'):
            declare(node, value, full)
        elif isinstance(value, tuple):
            _declare_texts(node, full, value, _descriptor(notes.get(name), kinds[name]))
        else:
            node.declare_parameter(full, value, _descriptor(notes.get(name), kinds[name]))


def _declare_texts(node: Node, name: str, texts: tuple[str, ...], descriptor: ParameterDescriptor) -> None:
    """Declare a list of texts, which may be empty: rclpy takes an empty list for one of bytes."""
    given = node.declare_parameter(name, Parameter.Type.STRING_ARRAY, descriptor)
    if given.type_ is Parameter.Type.NOT_SET:
        node.set_parameters([Parameter(name, Parameter.Type.STRING_ARRAY, list(texts))])


def read(node: Node, defaults: P, prefix: str = '') -> P:
    """Return the declared parameter set with the node's present values, or raise `ParameterError`."""
    values = {name: node.get_parameter(name).value for name in flattened(defaults, prefix)}
    try:
        return with_flattened(defaults, values, prefix)
    except ParameterError as error:
        raise ParameterError(f'{node.get_name()}: {error}') from None


def refuse_unknown(node: Node) -> None:
    """Raise `ParameterError` for a value that was given at the start to what is no parameter of `node`.

    ROS itself ignores it silently, so a misspelt name would leave a default at work.
    """
    known = list(node.get_parameters_by_prefix(''))
    for name in sorted(given_at_start(node)):
        check_name(node.get_name(), name, known)


def refuse_sim_time(node: Node) -> None:
    """Raise `ParameterError` if `node` was told to take its time from `/clock`."""
    if node.get_parameter(USE_SIM_TIME).value:
        raise ParameterError(f'{node.get_name()}: {SIM_TIME_REFUSED}')


def fitted(node: Node, parameters: Iterable[Parameter]) -> list[Parameter]:
    """Return parameters about to be set on `node` in the types that it has declared.

    A whole number becomes a float where one is wanted; so does the text of a float such as 5e-05 or nan, as
    which `ros2 param load` hands on what `ros2 param dump` has written. An empty list becomes one of the
    wanted kind, since ROS cannot tell of what it is empty. Raises `ParameterError` for an unknown name.
    """
    known = list(node.get_parameters_by_prefix(''))
    fit = []
    for parameter in parameters:
        check_name(node.get_name(), parameter.name, known)
        wanted = Parameter.Type(node.describe_parameter(parameter.name).type)
        if wanted is Parameter.Type.DOUBLE and parameter.type_ in _MAY_BE_FLOAT:
            with contextlib.suppress(ValueError):  # ROS refuses it then, by its type
                parameter = Parameter(parameter.name, value=float(parameter.value))
        elif wanted is Parameter.Type.STRING_ARRAY and _is_empty_list(parameter.value):
            parameter = Parameter(parameter.name, wanted, [])
        fit.append(parameter)
    return fit


_MAY_BE_FLOAT = (Parameter.Type.INTEGER, Parameter.Type.STRING)


def _is_empty_list(value: Any) -> bool:
    return isinstance(value, (list, tuple, array, bytes)) and len(value) == 0


class SpecimenValues:
    """Gives parameters the values of a file, except those that were set otherwise.

    Set otherwise is what came with the start of the node, even if it equals the default, and what was changed
    since to another value. After `give` the parameters of the node are those in use.
    """

    def __init__(self, node: Node):
        self._node = node
        self._given: dict[str, Any] = {}
        self._at_start = given_at_start(node)

    def give(self, defaults: NamedTuple, prefix: str, values: Mapping[str, Any]) -> None:
        """Set the declared parameters of the set `defaults` to `values` unless they were set otherwise.

        What an earlier file gave goes back to its default if this one does not name it. Raises
        `ParameterError` for a value that the parameter refuses.
        """
        changes = {}
        for name, default in flattened(defaults).items():
            full = f'{prefix}.{name}' if prefix else name
            present = self._node.get_parameter(full).value
            if full not in self._at_start and present == self._given.get(full, default):
                self._given[full] = values.get(name, default)
                if self._given[full] != present:
                    changes[full] = self._given[full]
        for result in self._node.set_parameters([Parameter(name, value=v) for name, v in changes.items()]):
            if not result.successful:
                raise ParameterError(f'{self._node.get_name()}: {result.reason}')


def _descriptor(quantity: Quantity | None, kind: type) -> ParameterDescriptor:
    descriptor = ParameterDescriptor()
    if quantity is None:
        return descriptor
    descriptor.description = f'{quantity.meaning} [{quantity.unit}]; {quantity.source}'
    if quantity.words:
        descriptor.additional_constraints = f'one of {quantity.limits}'
    if quantity.may_be_unknown:
        # rclpy holds NaN to be outside every range; `read` checks this one
        descriptor.description += '; nan: unknown'
        descriptor.additional_constraints = f'{quantity.limits} {quantity.unit}, or nan'
        return descriptor
    if math.isinf(quantity.low) != math.isinf(quantity.high):  # ROS knows ranges with two ends alone
        descriptor.additional_constraints = f'{quantity.limits} {quantity.unit}'
    if kind is float and math.isfinite(quantity.low) and math.isfinite(quantity.high):
        descriptor.floating_point_range = [
            FloatingPointRange(from_value=float(quantity.low), to_value=float(quantity.high))
        ]
    if kind is int and math.isfinite(quantity.low) and math.isfinite(quantity.high):
        descriptor.integer_range = [IntegerRange(from_value=int(quantity.low), to_value=int(quantity.high))]
    return descriptor


class DeclaringNode(OpenLifecycleNode):
    """Takes a whole number for a float, at the start and later, and names what is near an unknown name."""

    def declare_parameter(self, name: str, value: Any = None, *arguments, **options) -> Parameter:
        """Declare a parameter; raises `ParameterError` where what was given at the start does not fit it."""
        if isinstance(value, float):
            integer_as_float(self, name)
        try:
            return super().declare_parameter(name, value, *arguments, **options)
        except ParameterException as error:
            reason = str(error).removesuffix(f': {name}')
            raise ParameterError(f'{self.get_name()}: {reason}') from None

    def set_parameters(self, parameter_list: list[Parameter]) -> list[SetParametersResult]:
        """Set each parameter; see `set_parameters_atomically`."""
        return [self.set_parameters_atomically([parameter]) for parameter in parameter_list]

    def set_parameters_atomically(self, parameter_list: list[Parameter]) -> SetParametersResult:
        """Set all of the parameters or, for the reason in the result, none."""
        try:
            return super().set_parameters_atomically(fitted(self, parameter_list))
        except ParameterError as error:
            return SetParametersResult(successful=False, reason=str(error))


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
