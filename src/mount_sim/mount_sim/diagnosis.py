"""The simulator's verdict on itself, from figures alone."""

import math
from collections.abc import Iterator, Mapping
from typing import NamedTuple

from mount_ros.nodes.diagnostics import WINDOW, Finding, Level, Verdict, verdict_on
from mount_sim.loop import LoopFigures
from mount_sim.plant.simulated_car import Run, beyond_range_sentence

DRIVING, FINISHED = 'driving', 'finished'
LATE_SHARE = 0.05  # chosen: of the samples; beyond it the machine is too busy for real time
_LEAST_SAMPLES = 1000  # chosen: of fewer no share is taken


class Counted(NamedTuple):
    """What had been counted of a mount at one time, of which a verdict takes what came lately."""

    samples: int = 0
    overruns: int = 0
    beyond_range: int = 0


def counted(figures: LoopFigures) -> Counted:
    """Return the counts as they are now; `figures` go on."""
    return Counted(figures.samples, figures.overruns, figures.beyond_range.samples)


def verdict(
    figures: Mapping[str, LoopFigures], run: Run, earlier: Mapping[str, Counted], *, lockstep: bool
) -> Verdict:
    """Return level, sentence and figures, which carry the progress of the run.

    `earlier` are the counts of a window ago, or of the beginning. Of several mounts a finding has the name;
    of their figures the fewest samples, the sums and the greatest latencies count.
    """
    last = min(figures.values(), key=lambda each: each.samples)
    samples = last.samples  # goes on while this is written
    simulated = samples / run.sample_rate
    beyond = [each.beyond_range for each in figures.values() if each.beyond_range.samples]
    medians, percentiles = (
        [each.latency.quantile(share) for each in figures.values()] for share in (0.5, 0.99)
    )
    values = {
        'samples': samples,
        'samples_of_run': run.samples,
        'simulated_s': f'{simulated:.3f}',
        'excitation_start_s': f'{run.excitation_start / run.sample_rate:.3f}',
        'real_time_factor': f'{simulated / last.wall_time:.4f}' if last.wall_time > 0.0 else 'nan',
        'answered': sum(each.answered for each in figures.values()),
        'overruns': last.overruns,
        'latency_median_s': f'{max(medians):.7f}',
        'latency_p99_s': f'{max(percentiles):.7f}',
        'beyond_range': sum(each.samples for each in beyond),
        'first_beyond_range_s': f'{min((each.first for each in beyond), default=math.nan):.3f}',
        'fatal': bool(last.failure),
    }
    if last.failure:
        values['waiting_stamp'] = round((samples - 1) / run.sample_rate * 1e9)
        return verdict_on([Finding(Level.ERROR, last.failure, last.failure)], '', values)
    if samples >= run.samples:
        return Verdict(Level.OK, FINISHED, values)
    warnings = [
        Finding(Level.WARN, f'{name}: {kind}', f'{name}: {sentence}' if name else sentence)
        for name, each in figures.items()
        for kind, sentence in _warnings(each, earlier.get(name, Counted()), lockstep)
    ]
    return verdict_on(warnings, DRIVING, values)


def _warnings(figures: LoopFigures, earlier: Counted, lockstep: bool) -> Iterator[tuple[str, str]]:
    now, beyond = counted(figures), figures.beyond_range
    samples, overruns = now.samples - earlier.samples, now.overruns - earlier.overruns
    if now.beyond_range > earlier.beyond_range:
        yield 'beyond range', beyond_range_sentence(beyond.samples, beyond.first)
    if not lockstep and overruns > LATE_SHARE * max(samples, _LEAST_SAMPLES):
        yield (
            'late',
            f'{overruns} of {samples} samples were late (limit {100 * LATE_SHARE:g} % of {WINDOW:g} s): this '
            'machine is too busy for real time; close other programs, or use lock-step',
        )
