"""Which nodes have no other side yet for a topic that they cannot do without, and which are there twice."""

from collections.abc import Callable, Mapping, Sequence

from rclpy.node import Node

from mount_bringup.graph.nodes import RECORDER, GraphNode
from mount_ros.publishers import present_nodes
from mount_ros.topics import SESSION


def waiting(
    nodes: Sequence[GraphNode], figures: Callable[[GraphNode], Mapping[str, str]], namespace: str
) -> list[str]:
    """Return in words which of `nodes`, those of a graph, wait for which topics, by their own figures."""
    lacking = {node: unmatched(node, figures(node), nodes, namespace) for node in nodes}
    return [f'{node.full_name} waits for {", ".join(names)}' for node, names in lacking.items() if names]


def crowded(nodes: Sequence[GraphNode], seen_by: Node, own: int) -> str:
    """Return name and namespace of the first of `nodes` that is there more than `own` times; '' if none."""
    space = seen_by.get_namespace().rstrip('/')
    present = present_nodes(seen_by)
    for node in nodes:
        own_space = f'{space}/{node.mount}'.rstrip('/') or '/'
        if present.count((node.name, own_space)) > own:
            return f'{node.name} in namespace {own_space}'
    return ''


def unmatched(
    node: GraphNode, figures: Mapping[str, str], nodes: Sequence[GraphNode], namespace: str
) -> list[str]:
    """Return the names of these topics, by the node's own `figures`; `nodes` are those of the graph."""
    if 'unmatched' not in figures:
        return ['its first diagnostics']
    prefix = namespace.rstrip('/') + '/' + (f'{node.mount}/' if node.mount else '')
    names = {name.removeprefix(prefix) for name in figures['unmatched'].split(', ') if name}
    return sorted(names & _needed(node, nodes))


def _needed(node: GraphNode, nodes: Sequence[GraphNode]) -> set[str]:
    if not node.is_a(RECORDER):
        return set(node.needs)
    mounts = {other.mount for other in nodes if other.mount} or {''}
    needed = {(other.mount, name) for other in nodes for name in other.needs}
    needed |= {(mount, SESSION.name) for mount in mounts}
    return {f'{mount}/{name}' if mount else name for mount, name in needed}
