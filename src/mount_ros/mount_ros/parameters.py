"""Node parameters declared from parameter sets: unit, sentence and range travel with the value."""

import math
from typing import NamedTuple, TypeVar, get_type_hints

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.node import Node

from mount_models.quantity import ParameterError, Quantity, flattened, quantities, with_flattened

P = TypeVar('P', bound=NamedTuple)


def declare(node: Node, defaults: NamedTuple, prefix: str = '') -> None:
    """Declare every field of the parameter set `defaults` on `node`; nested ones as `outer.inner`."""
    notes = quantities(defaults)
    kinds = get_type_hints(type(defaults))
    for name, value in defaults._asdict().items():
        full = f'{prefix}.{name}' if prefix else name
        if hasattr(value, '_asdict'):
            declare(node, value, full)
        else:
            node.declare_parameter(full, value, _descriptor(notes.get(name), kinds[name]))


def read(node: Node, defaults: P, prefix: str = '') -> P:
    """Return the declared parameter set with the node's present values, or raise `ParameterError`."""
    values = {name: node.get_parameter(name).value for name in flattened(defaults, prefix)}
    try:
        return with_flattened(defaults, values, prefix)
    except ParameterError as error:
        raise ParameterError(f'{node.get_name()}: {error}') from None


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
