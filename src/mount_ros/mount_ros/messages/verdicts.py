"""What nodes say of themselves on `/diagnostics`, read from bytes."""

from typing import NamedTuple

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.serialization import deserialize_message


class ToldVerdict(NamedTuple):
    """The verdict of one node: its name with namespace, without a leading slash; figures as texts."""

    node: str
    sentence: str
    figures: dict[str, str]


def verdicts_of(raw: bytes) -> list[ToldVerdict]:
    """Return the verdicts in a serialised `DiagnosticArray`."""
    return [
        ToldVerdict(status.name, status.message, {value.key: value.value for value in status.values})
        for status in deserialize_message(raw, DiagnosticArray).status
    ]
