"""The control node's verdict on itself, from counts alone: those since the activation, and lately."""

from dataclasses import dataclass
from typing import NamedTuple

from mount_control.plausibility import HOLD
from mount_control.sample_watch import SampleCounts
from mount_ros.nodes.diagnostics import WINDOW, Finding, Level, Verdict, verdict_on


class Unread(NamedTuple):
    """How many messages could not be read since the node was configured, and why the last could not."""

    messages: int = 0
    reason: str = ''

    def and_another(self, error: Exception) -> 'Unread':
        """Return the count with another one."""
        return Unread(self.messages + 1, str(error))


_ALL_READ = Unread()
_LARGEST_BRIDGED = 0.001  # share of samples, chosen
_LIMIT = f'limit: none in {WINDOW:g} s'


class Counted(NamedTuple):
    """What had been counted at one time, of which a verdict takes what came lately."""

    samples: int = 0
    bridged: int = 0
    invalid: int = 0
    implausible: int = 0
    unread: int = 0


def counted(counts: SampleCounts, unread: Unread) -> Counted:
    """Return the counts as they are now; `counts` goes on."""
    return Counted(counts.samples, counts.bridged, counts.invalid, counts.implausible, unread.messages)


_NOTHING = Counted()


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
    lockstep: bool = False
    faults: int = 0  # times that the controller's memory held what is no finite number
    last_fault: int = 0  # stamp of the last such sample, ns
    policy: str = ''
    damper: str = ''
    parameter_changes: int = 0  # since the node was configured
    doubt: str = ''  # why displacements were not believed last, or empty
    doubted: bool = False  # whether they are not believed at present
    foreign: str = ''  # which other node has sent what only one may, or empty
    name_awaited: bool = False  # whether discovery may soon tell its name
    writer_doubt: str = ''  # which other node may, at present
    unread: Unread = _ALL_READ
    earlier: Counted = _NOTHING  # a window ago, or at the activation


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
        # In lock-step a supervisor ends the graph, with the name of the other node where one can be known.
        'fatal': bool(figures.foreign) and figures.lockstep and not figures.name_awaited,
    }
    well = 'damping on' if figures.damping_active else 'damping off'
    return verdict_on(_errors(figures) or _warnings(figures), well, values)


def _errors(figures: ControlFigures) -> list[Finding]:
    """Return the gravest error, none where damping is possible."""
    if figures.foreign:
        sentence = f'0 A: {figures.foreign}, then activate mount_init and mount_control again'
        return [Finding(Level.ERROR, figures.foreign, sentence)]
    if figures.table_refusal:
        return [Finding(Level.ERROR, figures.table_refusal, f'0 A: {figures.table_refusal}')]
    if figures.writer_doubt:
        return [
            Finding(Level.ERROR, figures.writer_doubt, f'0 A while this lasts: {figures.writer_doubt}'),
        ]
    if figures.silence > figures.longest_silence:
        sentence = (
            f'0 A: no displacement for {figures.silence:.2f} s (limit {figures.longest_silence:g} s); '
            'is mount_driver active and the electronics powered?'
        )
        return [Finding(Level.ERROR, 'silence', sentence)]
    if figures.faults:
        return [Finding(Level.ERROR, 'spoiled', FAULT_SENTENCE)]
    if figures.doubted:
        sentence = f'0 A until {HOLD:g} s after the last doubt: {figures.doubt}'
        return [Finding(Level.ERROR, figures.doubt, sentence)]
    return []


def _warnings(figures: ControlFigures) -> list[Finding]:
    """Return what was wrong with samples and messages lately."""
    now = counted(figures.counts, figures.unread)
    lately = Counted(*(count - before for count, before in zip(now, figures.earlier, strict=True)))
    found = []
    if lately.implausible:
        sentence = (
            f'{lately.implausible} displacement samples were implausible and answered with 0 A ({_LIMIT}); '
            f'first of the last ones: {figures.doubt}'
        )
        found.append(Finding(Level.WARN, f'implausible: {figures.doubt}', sentence))
    if lately.invalid:
        sentence = (
            f'{lately.invalid} of {lately.invalid + lately.samples} displacement samples were invalid and '
            f'answered with 0 A ({_LIMIT}); check the displacement sensor'
        )
        found.append(Finding(Level.WARN, 'invalid', sentence))
    if lately.bridged > _LARGEST_BRIDGED * lately.samples:
        sentence = (
            f'{lately.bridged} of {lately.samples} samples were missing and bridged (limit '
            f'{100 * _LARGEST_BRIDGED:g} % of {WINDOW:g} s); '
            "look at mount_driver's counts of lost frames"
        )
        found.append(Finding(Level.WARN, 'bridged', sentence))
    if lately.unread:
        sentence = (
            f'{lately.unread} messages could not be read and were not answered ({_LIMIT}), the last for '
            f'{figures.unread.reason:.200}; which node publishes them?'
        )
        found.append(Finding(Level.WARN, 'unread', sentence))
    return found


FAULT_SENTENCE = (
    'the controller held what is no finite number: damping was ended at 0 A and began afresh; '
    'set friction.* and contact.* of mount_control closer to their defaults'
)
"""What is told of a controller that has found its memory spoiled."""
