"""What `ros2 param describe` and `ros2 param load` say of the nodes of the graph."""

import gc
import importlib

import pytest
from rclpy.parameter import Parameter

from mount_bringup.graph.nodes import SIMULATED
from mount_ros.nodes.parameters import USE_SIM_TIME

OF_ROS = {USE_SIM_TIME, 'start_type_description_service'}


@pytest.fixture(params=SIMULATED, ids=lambda node: node.name)
def node(request, context):
    module = importlib.import_module(f'{request.param.name}.node')
    made = getattr(module, request.param.class_name)(context=context)
    yield made
    made.close()
    made.destroy_node()
    del made
    gc.collect()  # until then the services of a lifecycle node stay in the graph


def _own(node):
    return [name for name in node.get_parameters_by_prefix('') if name not in OF_ROS]


def test_every_parameter_has_a_sentence_and_every_number_a_range(node):
    described = {name: node.describe_parameter(name) for name in _own(node)}
    assert [name for name, each in described.items() if not each.description] == []
    numbers = {Parameter.Type.DOUBLE.value, Parameter.Type.INTEGER.value}
    without = [
        name
        for name, each in described.items()
        if each.type in numbers
        and not (each.floating_point_range or each.integer_range or each.additional_constraints)
    ]
    assert without == []


def test_everything_that_can_be_read_can_be_set_again(node):
    """As `ros2 param dump` and `ros2 param load` do."""
    own = node.get_parameters(_own(node))
    refused = [
        (parameter.name, result.reason)
        for parameter, result in zip(own, node.set_parameters(own), strict=True)
        if not result.successful
    ]
    assert refused == []
