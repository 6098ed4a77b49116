"""What nodes say of themselves on `/diagnostics`, read by all who listen."""

from typing import Any, NamedTuple


class ToldVerdict(NamedTuple):
    """The verdict of one node: its name with namespace, without a leading slash; figures as texts.

    The level has the numbers of `mount_ros.nodes.diagnostics.Level`.
    """

    node: str
    level: int
    sentence: str
    figures: dict[str, str]


def verdicts_of(raw: bytes) -> list[ToldVerdict]:
    """Return the verdicts in a serialised `DiagnosticArray`."""
    from diagnostic_msgs.msg import DiagnosticArray  # who reads recordings has it decoded without rclpy
    from rclpy.serialization import deserialize_message

    return verdicts_in(deserialize_message(raw, DiagnosticArray))


def verdicts_in(report: Any) -> list[ToldVerdict]:
    """Return the verdicts in a `DiagnosticArray`, as rclpy or as `engine_mount.recordings` has decoded it."""
    return [
        ToldVerdict(
            status.name,
            status.level[0] if isinstance(status.level, bytes) else int(status.level),
            status.message,
            {value.key: value.value for value in status.values},
        )
        for status in report.status
    ]
