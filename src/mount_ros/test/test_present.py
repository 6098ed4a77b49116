"""Which nodes are there: each is told once, and not any more when it is destroyed."""

from rclpy.node import Node
from ros_testing import wait_until

from mount_ros.publishers import present_nodes


def test_node_is_present_once_until_it_is_destroyed(context):
    here = Node('here', context=context, namespace='somewhere')
    other = Node('other', context=context)
    wait_until(lambda: len(present_nodes(here)) == 3, 'that the observer and two nodes are there')
    assert sorted(present_nodes(here)) == [('here', '/somewhere'), ('observer', '/test'), ('other', '/')]
    other.destroy_node()
    wait_until(lambda: ('other', '/') not in present_nodes(here), 'end')
    here.destroy_node()
