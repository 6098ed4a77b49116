"""Node parameters: declared from parameter sets with unit, sentence and range, and when they can be set."""

import contextlib
import math
from array import array
from collections.abc import Collection, Mapping
from typing import Any, NamedTuple, TypeVar, get_type_hints

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor, SetParametersResult
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
_NO_SIM_TIME = (
    'use_sim_time stays false: the stamps of the messages are the time of this graph, also of one that is '
    'played back, and its watches go by the steady clock; /clock is not needed'
)


def declare(node: Node, defaults: NamedTuple, prefix: str = '', only: Collection[str] | None = None) -> None:
    """Declare every field of the parameter set `defaults` on `node`; nested ones as `outer.inner`.

    With `only` no others than these fields.
    """
    notes, kinds = quantities(defaults), get_type_hints(type(defaults))
    for name, value in defaults._asdict().items():
        full = f'{prefix}.{name}' if prefix else name
        if only is not None and name not in only:
            continue
        if hasattr(value, '_asdict'):
            declare(node, value, full)
            continue
        descriptor = _descriptor(notes[name], kinds[name]) if name in notes else ParameterDescriptor()
        if not isinstance(value, tuple):
            node.declare_parameter(full, value, descriptor)
            continue
        # A list of texts, which may be empty: rclpy takes an empty list for one of bytes.
        given = node.declare_parameter(full, Parameter.Type.STRING_ARRAY, descriptor)
        if given.type_ is Parameter.Type.NOT_SET:
            node.set_parameters([Parameter(full, Parameter.Type.STRING_ARRAY, list(value))])


def read(node: Node, defaults: P, prefix: str = '') -> P:
    """Return the declared parameter set with the node's present values, or raise `ParameterError`."""
    values = {name: node.get_parameter(name).value for name in flattened(defaults, prefix)}
    return with_flattened(defaults, values, prefix)


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
        changes = []
        for name, default in flattened(defaults).items():
            full = f'{prefix}.{name}' if prefix else name
            present = self._node.get_parameter(full).value
            if full not in self._at_start and present == self._given.get(full, default):
                self._given[full] = values.get(name, default)
                if self._given[full] != present:
                    changes.append(Parameter(full, value=self._given[full]))
        for result in self._node.set_parameters(changes):
            if not result.successful:
                raise ParameterError(f'{self._node.get_name()}: {result.reason}')


class Change(NamedTuple):
    """A parameter before and after it was set."""

    old: Any
    new: Any


class ParameterNode(OpenLifecycleNode):
    """A lifecycle node that refuses parameters in words: of wrong types, of unknown names, at a wrong time.

    A whole number becomes a float where one is declared; so does the text of a float such as 5e-05 or nan, as
    which `ros2 param load` hands on what `ros2 param dump` has written. An empty list becomes one of the
    declared kind, since ROS cannot tell of what it is empty.

    From `fix_parameters` to `free_parameters` those in `run_time_parameters` alone can be set.
    """

    run_time_parameters: frozenset[str] = frozenset()
    """Names of the parameters that can be set on the configured node: `check_parameters`, `apply_changes`."""

    def __init__(self, name: str, **arguments):
        super().__init__(name, **arguments)
        self._in_use: dict[str, Any] = {}  # all values while they are fixed
        if self.get_parameter(USE_SIM_TIME).value:
            # rclpy takes /clock by now: up to 1000 messages a second beside the data.
            self.get_logger().warning(_NO_SIM_TIME)
            self.set_parameters([Parameter(USE_SIM_TIME, value=False)])
        self.add_on_set_parameters_callback(self._judge_parameters)
        self.add_post_set_parameters_callback(self._apply_parameters)

    def check_parameters(self, values: Mapping[str, Any]) -> None:
        """Raise a `ValueError` if the configured node could not go on with these values, {name: value}."""

    def apply_changes(self, changes: Mapping[str, Change]) -> None:
        """Go on with the parameters as they are now; `changes` were set while the node was configured."""

    def fix_parameters(self) -> None:
        """From now on the node works with what its parameters are."""
        self._in_use = {name: self.get_parameter(name).value for name in self._parameter_names()}

    def free_parameters(self) -> None:
        """Let everything be set again; safe to call twice."""
        self._in_use = {}

    def refuse_given(self) -> None:
        """Raise `ParameterError` for a value given at the start to an unknown name.

        ROS itself ignores an unknown name silently, so a misspelt one would leave a default at work.
        """
        for name in sorted(given_at_start(self)):
            check_name(self.get_name(), name, self._parameter_names())

    def declare_parameter(self, name: str, value: Any = None, *arguments, **options) -> Parameter:
        """Declare a parameter; a whole number given at the start for a float becomes one."""
        if isinstance(value, float):
            integer_as_float(self, name)
        return super().declare_parameter(name, value, *arguments, **options)

    def set_parameters(self, parameter_list: list[Parameter]) -> list[SetParametersResult]:
        """Set each parameter; see `set_parameters_atomically`."""
        return [self.set_parameters_atomically([parameter]) for parameter in parameter_list]

    def set_parameters_atomically(self, parameter_list: list[Parameter]) -> SetParametersResult:
        """Set all of the parameters or, for the reason in the result, none."""
        try:
            return super().set_parameters_atomically([self._converted(each) for each in parameter_list])
        except ParameterError as error:
            return SetParametersResult(successful=False, reason=str(error))

    def _converted(self, parameter: Parameter) -> Parameter:
        """Return a parameter about to be set in the type that is declared."""
        name, value = parameter.name, parameter.value
        check_name(self.get_name(), name, self._parameter_names())
        declared = Parameter.Type(self.describe_parameter(name).type)
        if declared is Parameter.Type.DOUBLE and type(value) in (int, str):
            with contextlib.suppress(ValueError):  # ROS refuses it then, by its type
                return Parameter(name, value=float(value))
        if declared is Parameter.Type.STRING_ARRAY and isinstance(value, list | tuple | array | bytes):
            return parameter if len(value) else Parameter(name, declared, [])
        return parameter

    def _parameter_names(self) -> frozenset[str]:
        return frozenset(self.get_parameters_by_prefix(''))

    def _judge_parameters(self, parameters: list[Parameter]) -> SetParametersResult:
        changes, reason = self._changes(parameters), ''
        fixed = [name for name in changes if name not in self.run_time_parameters]
        if any(parameter.name == USE_SIM_TIME and parameter.value for parameter in parameters):
            reason = _NO_SIM_TIME
        elif fixed:
            known = ', '.join(sorted(self.run_time_parameters)) or 'nothing'
            reason = (
                f'{fixed[0]} can be set before configure: deactivate and clean up first; '
                f'what can be set at run time is {known}'
            )
        elif changes:
            try:
                self.check_parameters({**self._in_use, **{name: each.new for name, each in changes.items()}})
            except ValueError as error:
                reason = str(error)
        return SetParametersResult(successful=not reason, reason=reason)

    def _apply_parameters(self, parameters: list[Parameter]) -> None:
        if changes := self._changes(parameters):
            self._in_use.update({name: change.new for name, change in changes.items()})
            self.apply_changes(changes)

    def _changes(self, parameters: list[Parameter]) -> dict[str, Change]:
        used = self._in_use
        return {
            parameter.name: Change(used[parameter.name], parameter.value)
            for parameter in parameters
            if parameter.name in used and parameter.value != used[parameter.name]
        }


def _descriptor(quantity: Quantity, kind: type) -> ParameterDescriptor:
    limits, low, high = quantity.limits, quantity.low, quantity.high
    descriptor = ParameterDescriptor(description=f'{quantity.meaning} [{quantity.unit}]; {quantity.source}')
    # ROS knows ranges of numbers with two ends alone, and rclpy holds NaN to be outside each.
    if quantity.may_be_unknown:
        descriptor.additional_constraints = f'{limits} {quantity.unit}, or nan: unknown'
    elif kind is float and math.isfinite(high - low):
        descriptor.floating_point_range = [FloatingPointRange(from_value=float(low), to_value=float(high))]
    elif kind is int and math.isfinite(high - low):
        descriptor.integer_range = [IntegerRange(from_value=int(low), to_value=int(high))]
    elif limits:
        descriptor.additional_constraints = f'{limits} {quantity.unit}'
    return descriptor
