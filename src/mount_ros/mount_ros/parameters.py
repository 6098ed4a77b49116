"""Node parameters declared from parameter sets: unit, sentence and range travel with the value."""

import math
from typing import Any, NamedTuple, TypeVar, get_type_hints

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.node import Node

from mount_models.quantity import ParameterError, Quantity, checked, quantities

P = TypeVar('P', bound=NamedTuple)


def declare(node: Node, defaults: P, prefix: str = '') -> None:
    """Declare every field of the parameter set `defaults` on `node`, as `prefix.field` where given."""
    notes = quantities(defaults)
    kinds = get_type_hints(type(defaults))
    for name, value in defaults._asdict().items():
        descriptor = _descriptor(notes.get(name), kinds[name])
        node.declare_parameter(_full_name(prefix, name), value, descriptor)


def read(node: Node, defaults: P, prefix: str = '') -> P:
    """Return the declared parameter set with the node's present values, or raise `ParameterError`."""
    values: dict[str, Any] = {
        name: node.get_parameter(_full_name(prefix, name)).value for name in defaults._fields
    }
    try:
        return checked(defaults._replace(**values))
    except ParameterError as error:
        raise ParameterError(f'{node.get_name()}: {prefix + "." if prefix else ""}{error}') from None


def _full_name(prefix: str, name: str) -> str:
    return f'{prefix}.{name}' if prefix else name


def _descriptor(quantity: Quantity | None, kind: type) -> ParameterDescriptor:
    descriptor = ParameterDescriptor()
    if quantity is None:
        return descriptor
    descriptor.description = f'{quantity.meaning} [{quantity.unit}]; {quantity.source}'
    if kind is float and math.isfinite(quantity.low) and math.isfinite(quantity.high):
        descriptor.floating_point_range = [
            FloatingPointRange(from_value=float(quantity.low), to_value=float(quantity.high))
        ]
    if kind is int and math.isfinite(quantity.low) and math.isfinite(quantity.high):
        descriptor.integer_range = [IntegerRange(from_value=int(quantity.low), to_value=int(quantity.high))]
    return descriptor
