"""Which nodes are there, by what they hold open in the middleware and not by the names that were told."""

from rclpy.node import Node


def present_nodes(seen_by: Node) -> list[tuple[str, str]]:
    """Return name and namespace of every node that `seen_by` sees, itself included.

    The list of names that rclpy gives keeps for ever those of a process whose last words were read after its
    end was known: rmw_dds_common 3.2, `GraphCache::update_participant_entities`, makes an unknown participant
    known. So the publishers that each node has on `/parameter_events` are counted instead.
    """
    infos = seen_by.get_publishers_info_by_topic('/parameter_events')
    return [(info.node_name, info.node_namespace) for info in infos]
