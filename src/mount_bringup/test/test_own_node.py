"""The supervisor's own node where the middleware does not start."""

import pytest

from mount_bringup.graph.errors import GraphError
from mount_bringup.graph.nodes import SIMULATED, GraphSettings
from mount_bringup.graph.own_node import OwnNode
from mount_bringup.graph.verdicts import Verdicts


def test_a_middleware_that_does_not_start_is_an_error_of_the_graph_and_leaves_nothing_to_close():
    own = OwnNode(GraphSettings(domain=-1), [''], Verdicts(SIMULATED, ''))
    with pytest.raises(GraphError, match=r'^the middleware does not start: Domain id \(-1\) '):
        own.open()
    assert own.close()
