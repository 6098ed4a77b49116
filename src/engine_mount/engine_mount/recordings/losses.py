"""What a recording lacks and what went wrong in it: the figures that every command tells, and their words."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from engine_mount.recordings.audit import TopicAudit
from engine_mount.recordings.faults import Fault, faults
from engine_mount.recordings.recording import Recording
from mount_models.sampling import SETPOINT_TIMEOUT

_SHOWN = 5  # faults named one by one


@dataclass(frozen=True)
class Losses:
    """The figures of one recording, of all its mounts together.

    `lost_samples` of `samples` were taken by the electronics and lack their displacement or ripple;
    `lost_messages` are those of any topic that were sent and are not there. While control was active,
    `asked` samples were taken, of which `unanswered` have no setpoint and `late` one that came too late to be
    used. `misdated` messages have a stamp that is none of a sample. None where the recording cannot tell.
    """

    samples: int | None
    lost_samples: int | None
    lost_messages: int | None
    asked: int | None
    unanswered: int | None
    late: int | None
    misdated: int
    faults: tuple[Fault, ...]
    whole: bool  # nothing of the recording is known to be damaged or missing

    @property
    def sound(self) -> bool:
        """Whether nothing is known to be lost, unanswered or wrong: the rule of the exit code."""
        return not self.complaints()

    @property
    def lossless(self) -> bool:
        """Whether nothing is known to be lost."""
        return self.whole and not self.lost_samples and not self.lost_messages

    def complaints(self) -> list[str]:
        """Return a sentence for each figure that is not as it should be."""
        first = f'{len(self.faults)}, the first at {self.faults[0]}' if self.faults else ''
        rules = (
            (self.lost_samples or self.lost_messages, f'samples lost: {self.lost_text()}'),
            (self.unanswered, f'samples unanswered: {self.answers_text()}'),
            (self.misdated, f'messages misdated: {self.misdated}; the audit tells their topics'),
            (self.faults, f'faults: {first}'),
            (not self.whole, 'the recording is not whole'),
        )
        return [sentence for broken, sentence in rules if broken]

    def rows(self) -> list[tuple[str, str]]:
        """Return names and texts of the figures, as every command and report tells them."""
        return [
            ('samples lost', self.lost_text()),
            ('samples unanswered', self.answers_text()),
            ('faults', self.faults_text()),
        ]

    def lost_text(self) -> str:
        """Return the lost samples and messages in words."""
        if self.lost_samples is None:
            return 'cannot be told' if self.lost_messages is None else f'{self.lost_messages} messages'
        messages = f' ({self.lost_messages} messages of all topics)' if self.lost_messages else ''
        return f'{self.lost_samples} of {self.samples}{messages}'

    def answers_text(self) -> str:
        """Return the unanswered and the late samples in words."""
        if self.unanswered is None:
            return 'cannot be told, no setpoint was recorded'
        late = f'; {self.late} answered later than {1e3 * SETPOINT_TIMEOUT:g} ms' if self.late else ''
        return f'{self.unanswered} of {self.asked} while control was active{late}'

    def faults_text(self) -> str:
        """Return how many faults there are, and the first in words, each on a line of its own."""
        if not self.faults:
            return 'none'
        rest = len(self.faults) - _SHOWN
        more = [f'and {rest} more'] if rest > 0 else []
        return f'{len(self.faults)}:\n' + ';\n'.join([*map(str, self.faults[:_SHOWN]), *more])

    def as_json(self) -> dict[str, Any]:
        """Return the figures as JSON knows them: unknown is null, times are in s."""
        return {
            'samples': self.samples,
            'lost_samples': self.lost_samples,
            'lost_messages': self.lost_messages,
            'asked_samples': self.asked,
            'unanswered_samples': self.unanswered,
            'late_samples': self.late,
            'misdated_messages': self.misdated,
            'faults': [
                {'time_s': round(fault.time, 6), 'node': fault.node or None, 'sentence': fault.sentence}
                for fault in self.faults
            ],
        }


def losses(recording: Recording, audits: Mapping[str, TopicAudit]) -> Losses:
    """Return the figures of a recording from its audit."""
    sampled = [entry for entry in audits.values() if entry.lost_samples is not None]
    answers = [entry.answers for entry in audits.values() if entry.answers is not None]
    return Losses(
        samples=_sum(entry.expected for entry in sampled),
        lost_samples=_sum(entry.lost_samples for entry in sampled),
        lost_messages=_sum(entry.lost for entry in audits.values()),
        asked=_sum(each.asked for each in answers),
        unanswered=_sum(each.unanswered for each in answers),
        late=_sum(each.late for each in answers),
        misdated=_sum(entry.misdated for entry in audits.values()) or 0,
        faults=tuple(faults(recording, audits)),
        whole=recording.whole,
    )


def _sum(counts: Iterable[int | None]) -> int | None:
    known = [count for count in counts if count is not None]
    return sum(known) if known else None
