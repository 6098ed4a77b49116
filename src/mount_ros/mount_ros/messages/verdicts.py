"""What nodes report of themselves on `/diagnostics`: their verdicts, and what these decide in a graph."""

from collections.abc import Mapping
from enum import IntEnum
from typing import Any, NamedTuple

from mount_ros.messages.cdr import deserialise
from mount_ros.topics import DIAGNOSTICS


class Level(IntEnum):
    """Severity, with the numbers of `diagnostic_msgs/DiagnosticStatus`."""

    OK = 0
    WARN = 1
    ERROR = 2
    STALE = 3


class Flags(NamedTuple):
    """Those figures of a node that decide about a graph; each is `True` or absent on `/diagnostics`."""

    fatal: bool = False
    """The graph must end."""
    failed: bool = False
    """The node gives its work up, the graph goes on."""
    needs_initialisation: bool = False
    """The mount must be initialised anew."""
    switched_off: bool = False
    """The driver keeps the coil at 0 A until its next activation."""
    held: bool = False
    """The driver keeps the coil at 0 A while something lasts."""
    coil_model_known: bool = False
    """The driver knows how warm the coil is."""


def flags_of(figures: Mapping[str, str]) -> Flags:
    """Return the flags among the figures of a node, as they came by `/diagnostics`."""
    return Flags(*(figures.get(name) == 'True' for name in Flags._fields))


class NodeVerdict(NamedTuple):
    """The verdict of one node: its name with namespace, without a leading slash; figures as texts.

    The level has the numbers of `Level`.
    """

    node: str
    level: int
    sentence: str
    figures: dict[str, str]


def verdicts_of(raw: bytes) -> list[NodeVerdict]:
    """Return the verdicts in a serialised `DiagnosticArray`."""
    return verdicts_in(deserialise(raw, DIAGNOSTICS.type))


def verdicts_in(report: Any) -> list[NodeVerdict]:
    """Return the verdicts in a `DiagnosticArray`, decoded by rclpy or by a reader of recordings."""
    return [
        NodeVerdict(
            status.name,
            status.level[0] if isinstance(status.level, bytes) else int(status.level),
            status.message,
            {value.key: value.value for value in status.values},
        )
        for status in report.status
    ]
