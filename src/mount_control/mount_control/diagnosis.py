"""The control node's verdict on itself, from counts alone, and what its log says of damping."""

from dataclasses import asdict, dataclass
from typing import NamedTuple

from mount_control.control_loop import ControlLoop, SampleCounts
from mount_control.plausibility import HOLD
from mount_ros.nodes.diagnostics import Finding, Level, Verdict, verdict_on
from mount_ros.nodes.sliding_window import WINDOW


class Unread(NamedTuple):
    """How many messages could not be read since the node was configured, and why the last could not."""

    messages: int = 0
    reason: str = ''

    def and_another(self, error: Exception) -> 'Unread':
        """Return the count with another one."""
        return Unread(self.messages + 1, str(error))


FAULT_SENTENCE = (
    'controller state became NaN or infinite: output 0 A, state reset; set friction.* and contact.* of '
    'mount_control closer to their defaults'
)
"""The message about a controller that has found its memory spoiled."""
_ALL_READ = Unread()
_LARGEST_BRIDGED = 0.001  # share of samples, chosen
_LIMIT = f'limit: none in {WINDOW:g} s'
_LOG_PERIOD = 1.0  # s, chosen: between two lines, not more than people read


class Counted(NamedTuple):
    """What had been counted at one time, or between two."""

    samples: int = 0
    bridged: int = 0
    invalid: int = 0
    implausible: int = 0
    unread: int = 0

    def since(self, earlier: 'Counted') -> 'Counted':
        """Return what has been counted since an earlier time."""
        return Counted(*(count - before for count, before in zip(self, earlier, strict=True)))


def counted(counts: SampleCounts, unread: Unread) -> Counted:
    """Return the counts as they are now; `counts` goes on."""
    return Counted(counts.samples, counts.bridged, counts.invalid, counts.implausible, unread.messages)


@dataclass(frozen=True)
class ControlFigures:
    """What the node adds to its control loop; times in s, NaN where unknown."""

    lately: Counted  # within the window, or since the activation
    silence: float  # since the last displacement sample
    longest_silence: float  # limit
    step_median: float  # from a sample received to its answer published
    step_p99: float
    lockstep: bool = False
    policy: str = ''
    damper: str = ''
    parameter_changes: int = 0  # since the node was configured
    name_awaited: bool = False  # whether discovery may soon have the name of a foreign writer
    unread: Unread = _ALL_READ


def verdict(loop: ControlLoop, figures: ControlFigures) -> Verdict:
    """Return level and sentence, worst first."""
    damping = loop.damping_active
    values = {
        **asdict(loop.counts),
        'faults': loop.faults,
        'last_fault': loop.last_fault,
        'damping_active': damping,
        'current_a': f'{loop.current:.4f}',
        'step_median_us': f'{1e6 * figures.step_median:.0f}',
        'step_p99_us': f'{1e6 * figures.step_p99:.0f}',
        'last_stamp': loop.last,
        'policy': figures.policy,
        'damper': figures.damper,
        'parameter_changes': figures.parameter_changes,
        'needs_initialisation': bool(loop.refusal),
        'messages_malformed': figures.unread.messages,
        # In lock-step a supervisor ends the graph, with the name of the other node where one can be known.
        'fatal': bool(loop.foreign) and figures.lockstep and not figures.name_awaited,
    }
    findings = _errors(loop, figures) or _warnings(figures, loop.plausibility.sentence)
    return verdict_on(findings, 'damping on' if damping else 'damping off', values)


def _errors(loop: ControlLoop, figures: ControlFigures) -> list[Finding]:
    """Return the gravest error, none where damping is possible."""
    doubt = loop.plausibility.sentence
    if cause := loop.foreign:
        sentence = f'0 A: {cause}, then activate mount_init and mount_control again'
    elif cause := loop.refusal:
        sentence = f'0 A: {cause}'
    elif cause := loop.writer_doubt:
        sentence = f'0 A while this lasts: {cause}'
    elif figures.silence > figures.longest_silence:
        cause = 'silence'
        sentence = (
            f'0 A: no displacement for {figures.silence:.2f} s (limit {figures.longest_silence:g} s); '
            'is mount_driver active and the electronics powered?'
        )
    elif loop.faults:
        cause, sentence = 'spoiled', FAULT_SENTENCE
    elif loop.plausibility.held:
        cause, sentence = doubt, f'0 A until {HOLD:g} s after the last doubt: {doubt}'
    else:
        return []
    return [Finding(Level.ERROR, cause, sentence)]


def _warnings(figures: ControlFigures, doubt: str) -> list[Finding]:
    """Return what was wrong with samples and messages lately; `doubt`: the last one on plausibility."""
    lately, found = figures.lately, {}
    if lately.implausible:
        found[f'implausible: {doubt}'] = (
            f'{lately.implausible} displacement samples were implausible and answered with 0 A ({_LIMIT}); '
            f'first of the last ones: {doubt}'
        )
    if lately.invalid:
        found['invalid'] = (
            f'{lately.invalid} of {lately.invalid + lately.samples} displacement samples were invalid and '
            f'answered with 0 A ({_LIMIT}); check the displacement sensor'
        )
    if lately.bridged > _LARGEST_BRIDGED * lately.samples:
        found['bridged'] = (
            f'{lately.bridged} of {lately.samples} samples were missing and bridged (limit '
            f'{100 * _LARGEST_BRIDGED:g} % of {WINDOW:g} s); '
            "look at mount_driver's counts of lost frames"
        )
    if lately.unread:
        found['unread'] = (
            f'{lately.unread} messages could not be read and were not answered ({_LIMIT}), the last for '
            f'{figures.unread.reason:.200}; which node publishes them?'
        )
    return [Finding(Level.WARN, cause, sentence) for cause, sentence in found.items()]


class DampingLog:
    """Turns looks at the controller into lines of the log, apart from the thread that answers samples.

    What goes on and off between two looks is not seen; a recording has each change.
    """

    def __init__(self) -> None:
        self._active = False  # at the last look
        self._began = 0.0  # time of the look that found damping on first, s
        self._changes = 0  # seen since the last line
        self._last_line = -_LOG_PERIOD  # s

    def look(self, active: bool, now: float) -> str:
        """Return the line on what has changed until `now` (s, steady clock), empty where nothing has."""
        lasted = now - self._began
        if active != self._active:
            self._active, self._changes = active, self._changes + 1
            if active:
                self._began = now
        if not self._changes or now - self._last_line < _LOG_PERIOD:
            return ''
        changes, self._changes, self._last_line = self._changes, 0, now
        if changes > 1:
            return f'damping {"on" if active else "off"}, the last of {changes} changes'
        return 'damping on' if active else f'damping off after {lasted:.1f} s'
