"""The supervisor's own node where the middleware does not start."""

import pytest

from mount_bringup.graph.graph import Graph
from mount_bringup.graph.nodes import SIMULATED, GraphError, GraphSettings


def test_a_middleware_that_does_not_start_is_an_error_of_the_graph_and_leaves_nothing_to_close():
    graph = Graph(SIMULATED, GraphSettings(domain=-1))
    with pytest.raises(GraphError, match=r'^the middleware does not start: Domain id \(-1\) '):
        graph.open()
    graph.close()
