"""The simulator's verdict on itself, from figures alone."""

import math
from collections.abc import Mapping
from typing import NamedTuple

from mount_ros.nodes.diagnostics import WINDOW, Finding, Level, Verdict, verdict_on
from mount_sim.loop import LoopFigures
from mount_sim.plant.places import ALONE
from mount_sim.plant.simulated_car import Run, beyond_range_sentence

DRIVING, FINISHED = 'driving', 'finished'
_OF_EACH = ('answered', 'latency_median_s', 'latency_p99_s', 'beyond_range', 'first_beyond_range_s')
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


_NOTHING = Counted()


def verdict(
    figures: Mapping[str, LoopFigures], run: Run, earlier: Mapping[str, Counted], *, lockstep: bool
) -> Verdict:
    """Return level, sentence and figures, which carry the progress of the run.

    `earlier` are the counts of a window ago, or of the beginning. Of several mounts the worst counts, with
    its name, and each has figures such as `left.answered`; of common figures that of the mount with the
    fewest samples or the greatest latency counts.
    """
    verdicts = {
        name: _mount_verdict(each, run, earlier.get(name, _NOTHING), lockstep=lockstep)
        for name, each in figures.items()
    }
    if ALONE in verdicts:
        return verdicts[ALONE]
    last = min(verdicts.values(), key=lambda each: int(str(each.figures['samples'])))
    values = dict(last.figures)
    for name, each in verdicts.items():
        values |= {f'{name}.{key}': each.figures[key] for key in _OF_EACH}
    values['answered'] = sum(each.answered for each in figures.values())
    for key in ('latency_median_s', 'latency_p99_s'):
        values[key] = max(str(each.figures[key]) for each in verdicts.values())
    beyond = [each.beyond_range for each in figures.values() if each.beyond_range.samples]
    values['beyond_range'] = sum(each.samples for each in beyond)
    values['first_beyond_range_s'] = f'{min((each.first for each in beyond), default=math.nan):.3f}'
    name, worst = max(verdicts.items(), key=lambda item: item[1].level)
    if worst.level is Level.OK or worst.figures['fatal']:
        return Verdict(worst.level, worst.sentence if worst.figures['fatal'] else last.sentence, values)
    named = [
        Finding(each.level, f'{name}: {each.name}', f'{name}: {each.sentence}') for each in worst.findings
    ]
    return verdict_on(named, '', values)


def _mount_verdict(figures: LoopFigures, run: Run, earlier: Counted, *, lockstep: bool) -> Verdict:
    samples = figures.samples  # goes on while this is written
    simulated = samples / run.sample_rate
    values = {
        'samples': samples,
        'samples_of_run': run.samples,
        'simulated_s': f'{simulated:.3f}',
        'excitation_start_s': f'{run.excitation_start / run.sample_rate:.3f}',
        'real_time_factor': f'{simulated / figures.wall_time:.4f}' if figures.wall_time > 0.0 else 'nan',
        'answered': figures.answered,
        'overruns': figures.overruns,
        'latency_median_s': f'{figures.latency.quantile(0.5):.7f}',
        'latency_p99_s': f'{figures.latency.quantile(0.99):.7f}',
        'beyond_range': figures.beyond_range.samples,
        'first_beyond_range_s': f'{figures.beyond_range.first:.3f}',
        'fatal': bool(figures.failure),
    }
    if figures.failure:
        values['waiting_stamp'] = round((samples - 1) / run.sample_rate * 1e9)
        return verdict_on([Finding(Level.ERROR, figures.failure, figures.failure)], '', values)
    if samples >= run.samples:
        return Verdict(Level.OK, FINISHED, values)
    return verdict_on(_warnings(figures, earlier, lockstep), DRIVING, values)


def _warnings(figures: LoopFigures, earlier: Counted, lockstep: bool) -> list[Finding]:
    now, beyond = counted(figures), figures.beyond_range
    samples, overruns = now.samples - earlier.samples, now.overruns - earlier.overruns
    found = []
    if now.beyond_range > earlier.beyond_range:
        sentence = beyond_range_sentence(beyond.samples, beyond.first)
        found.append(Finding(Level.WARN, 'beyond range', sentence))
    if not lockstep and overruns > LATE_SHARE * max(samples, _LEAST_SAMPLES):
        sentence = (
            f'{overruns} of {samples} samples were late (limit {100 * LATE_SHARE:g} % of {WINDOW:g} s): this '
            'machine is too busy for real time; close other programs, or use lock-step'
        )
        found.append(Finding(Level.WARN, 'late', sentence))
    return found
