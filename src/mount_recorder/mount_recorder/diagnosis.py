"""The recorder's verdict on itself, from its figures alone: all of them, and what came lately."""

from collections.abc import Mapping
from enum import Enum
from typing import Any

from mount_recorder.recorder import Unobserved
from mount_recorder.stamp_watch import FARTHEST
from mount_ros.nodes.diagnostics import WINDOW, Finding, Level, Verdict, verdict_on

LEAST_FREE = 1 << 30  # bytes, chosen
LEAST_TIME = 60.0  # s, chosen: how long the disk must last at the present rate

Figures = Mapping[str, Any]
"""Figures by their keys on `/diagnostics`; those of a topic are such as `missing.<topic>`."""


class OnFull(Enum):
    """What a disk without space means for the run."""

    STOP = 'stop'  # an error: the run shall end
    CONTINUE = 'continue'  # a warning: the run goes on without recording


def judge(
    figures: Figures,
    earlier: Figures,
    unobserved: Mapping[str, Unobserved],
    *,
    failure: str = '',
    on_full: OnFull = OnFull.STOP,
) -> Verdict:
    """Return level, sentence and figures of an active recorder.

    `earlier` are the figures of a window ago, or of its begin.
    """
    fatal = bool(failure) and on_full is OnFull.STOP
    publishers = [count for key, count in figures.items() if key.startswith('publishers.')]
    well = f'recording; {sum(map(bool, publishers))} of {len(publishers)} topics have a publisher'
    if fatal:
        findings = [Finding(Level.ERROR, failure, f'{failure}; free some space and start again')]
    elif failure:
        findings = [Finding(Level.WARN, failure, f'the run goes on without recording: {failure}')]
    else:
        table = _table(figures, earlier, unobserved)
        findings = [Finding(Level.WARN, name, sentence) for name, found, sentence in table if found]
    return verdict_on(findings, well, {**figures, 'failed': bool(failure), 'fatal': fatal})


def _table(
    figures: Figures, earlier: Figures, unobserved: Mapping[str, Unobserved]
) -> list[tuple[str, object, str]]:
    """Return name, condition and sentence of each warning."""
    none = f'limit: none in {WINDOW:g} s'
    lost = figures['lost'] - earlier.get('lost', 0)
    received = figures['received'] - earlier.get('received', 0)
    malformed, missing, misdated = (
        _growth(figures, earlier, key) for key in ('malformed.', 'missing.', 'misdated.')
    )
    free, rate = figures['free_bytes'], figures['bytes_per_second']
    last = [f'{topic} {count} (the last of {unobserved[topic].last})' for topic, count in malformed.items()]
    return [
        (
            'lost',
            lost > 0,
            f'{lost} of {received} messages lost ({none}): '
            'the disk is slower than the data; record fewer topics or use a faster disk',
        ),
        (
            f'unobserved {", ".join(malformed)}',
            malformed,
            f'malformed messages, recorded but neither watched nor marked: {", ".join(last)} ({none}); '
            'who else publishes there?',
        ),
        (
            f'missing {", ".join(missing)}',
            missing,
            f'samples missing between the stamps: {_counts(missing)} ({none}); is the machine overloaded?',
        ),
        (
            f'misdated {", ".join(misdated)}',
            misdated,
            f'stamps more than {FARTHEST / 1e9:g} s from the samples around them: {_counts(misdated)} '
            f'({none}); who else publishes there?',
        ),
        (
            'space',
            free < max(LEAST_FREE, rate * LEAST_TIME),
            f'{free / 1e9:.1f} GB left on the disk of {figures["folder"]} at {rate / 1e6:.1f} MB/s '
            f'(limit: {LEAST_FREE / 1e9:.1f} GB, and enough for {LEAST_TIME:g} s); free some space',
        ),
    ]


def _growth(figures: Figures, earlier: Figures, prefix: str) -> dict[str, int]:
    """Return by topic how much the counts of one kind have grown, where they have."""
    grown = {key: figures[key] - earlier.get(key, 0) for key in figures if key.startswith(prefix)}
    return {key.removeprefix(prefix): count for key, count in grown.items() if count > 0}


def _counts(counts: Mapping[str, int]) -> str:
    return ', '.join(f'{topic} {count}' for topic, count in counts.items())
