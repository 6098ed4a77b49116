"""The only file that uses names of rclpy which are not public, for what its public names do not offer.

`test_private_rclpy.py` names the one that another version of rclpy lacks or has changed.
"""

from collections.abc import Callable
from functools import partial
from typing import Any

from rclpy.lifecycle import LifecycleNode, TransitionCallbackReturn
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.publisher import Publisher
from rclpy.subscription import Subscription

Taken = tuple[bytes, dict[str, int]]
"""A serialised message, and its `source_timestamp` and `received_timestamp` in ns of the system clock."""


def raw_taker(subscription: Subscription) -> Callable[[], Taken | None]:
    """Return the function that takes the next message, None if there is none; no executor is needed.

    The subscription must not be destroyed meanwhile.
    """
    return partial(subscription.handle.take_message, subscription.msg_type, True)


def raw_publisher(publisher: Publisher) -> Callable[[bytes], None]:
    """Return the function that publishes serialised bytes, 6 to 11 us faster than `publish`.

    It raises an `RCLError` once the publisher is destroyed.
    """
    return publisher.handle.publish_raw


def given_at_start(node: Node) -> frozenset[str]:
    """Return the names of the parameters set from outside at the start, also to what equals their default."""
    return frozenset(node._parameter_overrides)


def integer_as_float(node: Node, name: str) -> None:
    """Let a whole number that was given from outside at the start for the parameter `name` be a float."""
    given = node._parameter_overrides.get(name)
    if given is not None and given.type_ is Parameter.Type.INTEGER:
        node._parameter_overrides[name] = Parameter(name, value=float(given.value))


class OpenLifecycleNode(LifecycleNode):
    """A lifecycle node whose transitions can be overridden, and whose services end with it."""

    def change_state(self, transition_id: int) -> TransitionCallbackReturn:
        """Make a transition asked for by service or by call; raises where it is not valid in this state."""
        return super()._LifecycleNodeMixin__change_state(transition_id)  # type: ignore[misc]

    def destroy_node(self) -> None:
        """Destroy the node; rclpy leaves it in the graph until nothing refers to its services."""
        super().destroy_node()
        self._state_machine.destroy_when_not_in_use()

    def _LifecycleNodeMixin__change_state(self, transition_id: int) -> Any:  # noqa: N802
        return self.change_state(transition_id)
