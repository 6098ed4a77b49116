"""Node parameters declared from parameter sets: unit, sentence and range travel with the value."""

import math
from collections.abc import Mapping
from typing import Any, NamedTuple, TypeVar, get_type_hints

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
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
from mount_ros.private_rclpy import given_at_start

P = TypeVar('P', bound=NamedTuple)


def declare(node: Node, defaults: NamedTuple, prefix: str = '') -> None:
    """Declare every field of the parameter set `defaults` on `node`; nested ones as `outer.inner`."""
    notes = quantities(defaults)
    kinds = get_type_hints(type(defaults))
    for name, value in defaults._asdict().items():
        full = f'{prefix}.{name}' if prefix else name
        if hasattr(value, '_asdict'):
            declare(node, value, full)
        elif isinstance(value, tuple):
            _declare_texts(node, full, value)
        else:
            node.declare_parameter(full, value, _descriptor(notes.get(name), kinds[name]))


def _declare_texts(node: Node, name: str, texts: tuple[str, ...]) -> None:
    """Declare a list of texts, which may be empty: rclpy takes an empty list for one of bytes."""
    given = node.declare_parameter(name, Parameter.Type.STRING_ARRAY)
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
    if quantity.may_be_unknown:
        descriptor.description += '; nan: unknown'
        return descriptor  # rclpy holds NaN to be outside every range; `read` checks this one
    if kind is float and math.isfinite(quantity.low) and math.isfinite(quantity.high):
        descriptor.floating_point_range = [
            FloatingPointRange(from_value=float(quantity.low), to_value=float(quantity.high))
        ]
    if kind is int and math.isfinite(quantity.low) and math.isfinite(quantity.high):
        descriptor.integer_range = [IntegerRange(from_value=int(quantity.low), to_value=int(quantity.high))]
    return descriptor
