"""A lifecycle node that takes parameters in the types that it has declared, or refuses them in words."""

from typing import Any

from rcl_interfaces.msg import SetParametersResult
from rclpy.exceptions import ParameterException
from rclpy.parameter import Parameter

from mount_models.quantity import ParameterError
from mount_ros.nodes.parameters import fitted
from mount_ros.private_rclpy import OpenLifecycleNode, integer_as_float


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
