"""The control node's verdict on itself, from counts alone."""

import operator
from collections.abc import Mapping
from dataclasses import asdict, astuple, dataclass
from typing import Any

from mount_control.control_loop import ControlLoop, SampleCounts
from mount_control.controller import FAULT_SENTENCE
from mount_control.plausibility import HOLD
from mount_ros.nodes.diagnostics import WINDOW, Finding, Level, Verdict, verdict_on

_LARGEST_BRIDGED = 0.001  # share of samples, chosen
_LIMIT = f'limit: none in {WINDOW:g} s'


def counted_since(earlier: SampleCounts, counts: SampleCounts) -> SampleCounts:
    """Return what has been counted since an earlier time."""
    return SampleCounts(*map(operator.sub, astuple(counts), astuple(earlier)))


@dataclass(frozen=True)
class ControlFigures:
    """What the node adds to its control loop; times in s, NaN where unknown."""

    lately: SampleCounts  # within the window, or since the activation
    silence: float  # since the last displacement sample
    longest_silence: float  # limit
    step_median: float  # from a sample received to its answer published
    step_p99: float
    foreign_is_fatal: bool  # whether a foreign writer ends the graph
    unread_reason: str  # why the last message could not be read
    values: Mapping[str, Any]  # more to be shown


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
        'needs_initialisation': bool(loop.refusal),
        'fatal': bool(loop.foreign) and figures.foreign_is_fatal,
        **figures.values,
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
    if lately.messages_malformed:
        found['unread'] = (
            f'{lately.messages_malformed} messages could not be read and were not answered ({_LIMIT}), the '
            f'last for {figures.unread_reason:.200}; which node publishes them?'
        )
    return [Finding(Level.WARN, cause, sentence) for cause, sentence in found.items()]
