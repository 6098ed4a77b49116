"""The control node's verdict on itself, from counts alone."""

import operator
from collections.abc import Mapping
from dataclasses import asdict, astuple
from typing import Any

from mount_control.control_loop import ControlLoop, SampleCounts
from mount_control.controller import FAULT_SENTENCE
from mount_control.plausibility import HOLD
from mount_control.shadow import LATEST, Shadow
from mount_ros.nodes.diagnostics import WINDOW, Finding, Level, Verdict, verdict_on

_LARGEST_BRIDGED = 0.001  # share of samples, chosen
_LIMIT = f'limit: none in {WINDOW:g} s'
_NO_SPEED = 'engine_speed not used, the law follows the displacement alone'


def counted_since(earlier: SampleCounts, counts: SampleCounts) -> SampleCounts:
    """Return what has been counted since an earlier time."""
    return SampleCounts(*map(operator.sub, astuple(counts), astuple(earlier)))


def verdict(
    loop: ControlLoop,
    lately: SampleCounts,
    doubted: int,
    silence: float,
    longest_silence: float,
    figures: Mapping[str, Any],
    shadow: Shadow | None = None,
    unseen: int = 0,
) -> Verdict:
    """Return level and sentence, worst first, and `figures` with those of loop and `shadow`.

    `lately`, messages of `engine_speed` that were `doubted` and `unseen` setpoints of the electronics were
    counted within the window, or since the activation; `silence` is the time (s) since the last displacement
    sample.
    """
    doubt, speed = loop.plausibility.sentence, loop.engine_speed
    difference = shadow.first_difference if shadow else ''
    errors = (
        (loop.foreign, f'0 A: {loop.foreign}, then activate mount_init and mount_control again'),
        (loop.refusal, f'0 A: {loop.refusal}'),
        (loop.writer_doubt, f'0 A while this lasts: {loop.writer_doubt}'),
        (
            'silence' if silence > longest_silence else '',
            f'0 A: no displacement for {silence:.2f} s (limit {longest_silence:g} s); is mount_driver active '
            'and the electronics powered?',
        ),
        ('spoiled' if loop.faults else '', FAULT_SENTENCE),
        (doubt if loop.plausibility.held else '', f'0 A until {HOLD:g} s after the last doubt: {doubt}'),
        ('shadow' if difference else '', difference),
    )
    warnings = (
        (
            f'implausible: {doubt}' if lately.implausible else '',
            f'{lately.implausible} displacement samples were implausible and answered with 0 A ({_LIMIT}); '
            f'first of the last ones: {doubt}',
        ),
        (
            'invalid' if lately.invalid else '',
            f'{lately.invalid} of {lately.invalid + lately.samples} displacement samples were invalid and '
            f'answered with 0 A ({_LIMIT}); check the displacement sensor',
        ),
        (
            'bridged' if lately.bridged > _LARGEST_BRIDGED * lately.samples else '',
            f'{lately.bridged} of {lately.samples} samples were missing and bridged (limit '
            f'{100 * _LARGEST_BRIDGED:g} % of {WINDOW:g} s); '
            "look at mount_driver's counts of lost frames",
        ),
        ('engine speed conflict' if speed.conflict else '', f'{_NO_SPEED}: {speed.conflict}'),
        (
            'engine speed stopped' if speed.stopped(loop.last) else '',
            f'{_NO_SPEED}: none for more than {1e-9 * speed.timeout:g} s; look at mount_driver',
        ),
        (
            'engine speed doubted' if doubted else '',
            f'{_NO_SPEED} in {doubted} messages ({_LIMIT}); the last: {speed.doubt}',
        ),
        (
            'unseen' if unseen else '',
            f'{unseen} setpoints of the electronics were missing or {1e-6 * LATEST:g} ms late ({_LIMIT}); '
            "look at mount_driver's counts of lost frames; has their law a table?",
        ),
    )
    findings = [
        Finding(level, cause, sentence)
        for level, found in ((Level.ERROR, errors), (Level.WARN, warnings))
        for cause, sentence in found
        if cause
    ]
    figures = {
        **asdict(loop.counts),
        'faults': loop.faults,
        'damping_active': loop.damping_active,
        'current_a': f'{loop.current:.4f}',
        'last_stamp': loop.last,
        'needs_initialisation': bool(loop.refusal),
        **(shadow.figures if shadow else {}),
        **figures,
    }
    return verdict_on(findings, 'damping on' if loop.damping_active else 'damping off', figures)
