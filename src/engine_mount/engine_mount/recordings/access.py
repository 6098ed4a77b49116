"""Recordings by their path: opened, audited, compared."""

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

from engine_mount.recordings.audit import TopicAudit
from engine_mount.recordings.audit import audit as audit_topics
from engine_mount.recordings.compare import Comparison
from engine_mount.recordings.compare import compare as compare_recordings
from engine_mount.recordings.difference import Tolerances
from engine_mount.recordings.losses import Losses, as_json, as_table, latency_sentences, losses, sentences
from engine_mount.recordings.recording import Recording, open_run
from engine_mount.recordings.screen import Table

Source: TypeAlias = str | os.PathLike[str] | Recording
"""A recording, or the path of one: its folder, one of its files, or the folder of a run."""


class Audit(NamedTuple):
    """What a recording lacks and what went wrong in it: by topic, and in all."""

    topics: dict[str, TopicAudit]
    losses: Losses
    warnings: Sequence[str]

    @property
    def sound(self) -> bool:
        """Whether nothing is known to be lost, unanswered or wrong."""
        return self.losses.sound

    @property
    def figures(self) -> dict[str, Any]:
        """All figures as JSON has them: unknown is None, times are in s."""
        return as_json(self.topics, self.losses)

    @property
    def table(self) -> Table:
        """The figures of each topic."""
        return as_table(self.topics)

    def sentences(self) -> list[str]:
        """Return what was found, in words."""
        return [*latency_sentences(self.topics), *sentences(self.topics, self.losses)]


def open(source: Source) -> Recording:
    """Return the recording of `source`; raises `ReadingError` for what is none."""
    return source if isinstance(source, Recording) else open_run(Path(source))


def audit(source: Source) -> Audit:
    """Return whether anything was lost in a recording or went wrong in the drive; raises `ReadingError`."""
    recording = open(source)
    topics = audit_topics(recording)
    return Audit(topics, losses(recording, topics), recording.warnings)


def compare(a: Source, b: Source, tolerances: Sequence[str] = (), *, common: bool = False) -> Comparison:
    """Return how recording `b` differs from `a`, sample by sample.

    `tolerances` are texts such as `signal=0.01` (in its unit) or `1%` (of the largest value); `common` leaves
    out the time that one of them alone covers. Raises `ReadingError` or `ComparisonError`.
    """
    return compare_recordings(open(a), open(b), Tolerances(list(tolerances)), common_only=common)
