"""Which topics that a node cannot do without have no other side yet."""

from collections.abc import Mapping, Sequence

from mount_bringup.graph.nodes import RECORDER, GraphNode
from mount_ros.topics import SESSION


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
