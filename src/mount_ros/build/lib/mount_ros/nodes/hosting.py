"""Nodes in a process that also does other work: a context of its own, transitions without a supervisor."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

import rclpy
from rclpy.context import Context
from rclpy.lifecycle import TransitionCallbackReturn
from rclpy.signals import SignalHandlerOptions

from mount_ros.nodes.lifecycle import SafeLifecycleNode


class TransitionError(ValueError):
    """A node refused a transition; the text names it and its reason."""


@contextmanager
def ros_context(domain: int) -> Iterator[Context]:
    """Give a context of the middleware in a ROS domain."""
    context = Context()
    rclpy.init(context=context, domain_id=domain, signal_handler_options=SignalHandlerOptions.NO)
    try:
        yield context
    finally:
        rclpy.try_shutdown(context=context)


def transition(step: Callable[[], TransitionCallbackReturn], node: SafeLifecycleNode, name: str) -> None:
    """Take a node through a transition, or raise `TransitionError` with the node's own reason."""
    if step() != TransitionCallbackReturn.SUCCESS:
        raise TransitionError(f'{name} refused: {node.sentence}')
