"""The control node's verdict on itself, from counts alone."""

from dataclasses import dataclass
from typing import NamedTuple

from mount_control.plausibility import HOLD
from mount_control.sample_watch import SampleCounts
from mount_ros.nodes.diagnostics import Level, Verdict


class Unread(NamedTuple):
    """How many messages could not be read since the node was configured, and why the last could not."""

    messages: int = 0
    reason: str = ''

    def and_another(self, error: Exception) -> 'Unread':
        """Return the count with another one."""
        return Unread(self.messages + 1, str(error))


_ALL_READ = Unread()


@dataclass(frozen=True)
class ControlFigures:
    """What the verdict is made of; times in s, NaN or None where unknown."""

    counts: SampleCounts
    silence: float  # s since the last displacement sample
    longest_silence: float  # s, limit
    table_refusal: str  # why the table no longer holds, or empty
    damping_active: bool
    current: float  # A
    step_median: float  # s, sample received to setpoint published
    step_p99: float  # s
    last_stamp: int | None  # ns
    faults: int = 0  # times that the controller's memory held what is no finite number
    last_fault: int = 0  # stamp of the last such sample, ns
    policy: str = ''
    damper: str = ''
    parameter_changes: int = 0  # since the node was configured
    doubt: str = ''  # why displacements were not believed last, or empty
    doubted: bool = False  # whether they are not believed at present
    foreign: str = ''  # which other node has sent what only one may, or empty
    writer_doubt: str = ''  # which other node may, at present
    unread: Unread = _ALL_READ


def verdict(figures: ControlFigures) -> Verdict:
    """Return level and sentence, worst first."""
    values = {
        'samples': figures.counts.samples,
        'bridged': figures.counts.bridged,
        'restarts': figures.counts.restarts,
        'ignored': figures.counts.ignored,
        'invalid': figures.counts.invalid,
        'implausible': figures.counts.implausible,
        'faults': figures.faults,
        'last_fault': figures.last_fault,
        'damping_active': figures.damping_active,
        'current_a': f'{figures.current:.4f}',
        'step_median_us': f'{1e6 * figures.step_median:.0f}',
        'step_p99_us': f'{1e6 * figures.step_p99:.0f}',
        'last_stamp': figures.last_stamp,
        'policy': figures.policy,
        'damper': figures.damper,
        'parameter_changes': figures.parameter_changes,
        'needs_initialisation': bool(figures.table_refusal),
        'messages_malformed': figures.unread.messages,
        'fatal': bool(figures.foreign),  # a supervisor ends the graph
    }
    level, sentence = _judgement(figures)
    return Verdict(level, sentence, values)


def _judgement(figures: ControlFigures) -> tuple[Level, str]:
    if figures.foreign:
        return Level.ERROR, f'0 A: {figures.foreign}, then activate mount_init and mount_control again'
    if figures.table_refusal:
        return Level.ERROR, f'0 A: {figures.table_refusal}'
    if figures.writer_doubt:
        return Level.ERROR, f'0 A while this lasts: {figures.writer_doubt}'
    if figures.silence > figures.longest_silence:
        return Level.ERROR, (
            f'0 A: no displacement for {figures.silence:.2f} s (limit {figures.longest_silence:g} s); '
            'is mount_driver active and the electronics powered?'
        )
    if figures.faults:
        return Level.ERROR, fault_sentence(figures.faults)
    if figures.doubted:
        return Level.ERROR, f'0 A until {HOLD:g} s after the last doubt: {figures.doubt}'
    counts = figures.counts
    if counts.implausible:
        return Level.WARN, (
            f'{counts.implausible} displacement samples were implausible and answered with 0 A; '
            f'first of the last ones: {figures.doubt}'
        )
    if counts.invalid:
        return Level.WARN, (
            f'{counts.invalid} of {counts.invalid + counts.samples} displacement samples were invalid '
            'and answered with 0 A; check the displacement sensor'
        )
    if counts.bridged > 0.001 * counts.samples:
        return Level.WARN, (
            f'{counts.bridged} of {counts.samples} samples were missing and bridged (limit 0.1 %); '
            "look at mount_driver's counts of lost frames"
        )
    if figures.unread.messages:
        return Level.WARN, (
            f'{figures.unread.messages} messages could not be read and were not answered (limit: none), the '
            f'last for {figures.unread.reason:.200}; which node publishes them?'
        )
    return Level.OK, 'damping on' if figures.damping_active else 'damping off'


def fault_sentence(faults: int) -> str:
    """Return what is to be told of a controller that found its memory spoiled so many times."""
    times = 'once' if faults == 1 else f'{faults} times'
    return (
        f'the controller held what is no finite number, {times}: damping was ended at 0 A and began afresh; '
        'set friction.* and contact.* of mount_control closer to their defaults'
    )
