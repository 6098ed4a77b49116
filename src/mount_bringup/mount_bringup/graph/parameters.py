"""The parameters of a running node, asked for by its services."""

from collections.abc import Callable
from typing import Any

from rcl_interfaces.srv import GetParameters, ListParameters
from rclpy.parameter import parameter_value_to_python


def parameters_of(node: str, call: Callable[[Any, str, Any], Any]) -> dict[str, object]:
    """Return {name: value} of a node; `call` asks a service of a type and a name with a request."""
    names = call(ListParameters, f'{node}/list_parameters', ListParameters.Request())
    request = GetParameters.Request(names=sorted(names.result.names))
    values = call(GetParameters, f'{node}/get_parameters', request).values
    return {name: parameter_value_to_python(value) for name, value in zip(request.names, values, strict=True)}
