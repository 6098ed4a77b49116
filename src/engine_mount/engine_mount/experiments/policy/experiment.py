"""Policies side by side: sweep, gap, rack, roads, other engines, idle, wear; and what no policy can beat."""

from typing import Any

from engine_mount.experiments.harness.contract import (
    Experiment,
    Holds,
    Order,
    Outcome,
    Progress,
    Statement,
    parameters_of,
)
from engine_mount.experiments.harness.number_list import numbers_of
from engine_mount.experiments.policy import REFERENCE, TITLE
from engine_mount.experiments.policy.cases import CONTINUOUS, NAME, PAPER, Axes, PolicyParameters, jobs_of
from engine_mount.experiments.policy.evaluation import figures_of
from engine_mount.experiments.policy.runs import run_policy_job
from engine_mount.experiments.sensitivity.grid import run_all


def run(order: Order, progress: Progress) -> Outcome:
    """Run all combinations, and write pictures and a page from the numbers."""
    from engine_mount.experiments.policy import pictures as drawing
    from engine_mount.experiments.policy.page import write_policy

    parameters = parameters_of(order, NAME, PolicyParameters())
    axes = axes_of(parameters)
    jobs = jobs_of(order, parameters, axes)
    found = run_all(
        jobs,
        parameters.workers,
        lambda done: progress(0.95 * done / len(jobs), f'{done} of {len(jobs)} runs'),
        run_policy_job,
    )
    progress(0.95, 'bounds and pictures')
    figures = figures_of(found, parameters, axes)
    pictures = drawing.draw_all(found, figures, axes, order.out / 'figures')
    page = write_policy(figures, pictures, order.out / 'policy.md')
    return Outcome(figures, pictures, [], statements(figures), [page])


def axes_of(parameters: PolicyParameters) -> Axes:
    """Return the values of all lists; raises `ParameterError` for a text that is no list of such numbers."""

    def numbers(name: str, low: float, high: float) -> list[float]:
        return numbers_of(f'{NAME}.{name}', getattr(parameters, name), low, high)

    return Axes(
        numbers('road_levels', 1e-3, 1.0),
        numbers('gap_depths', 1e-3, 0.1),
        numbers('rack_frequencies', 1.0, 50.0),
        numbers('engines', 5.0, 12.0),
        numbers('engine_levels', 1e-3, 1.0),
        numbers('idle_frequencies', 10.0, 60.0),
        numbers('idle_forces', 1.0, 2000.0),
    )


def statements(figures: dict[str, Any]) -> list[Statement]:
    """Return what the paper says that depends on the policy, with what these figures say to it."""
    sweep, gap = figures['sweep_ratio'], figures['gap_peak_ratio']

    def told(policy: str) -> str:
        ratios = ', '.join(f'{value:.2f} ({level} m/s)' for level, value in sweep[policy].items())
        peaks = max(value for values in gap[policy].values() for value in values)
        return f'{policy}: {ratios}; over a gap at most {peaks:.2f}'

    ours = [*sweep[CONTINUOUS].values(), *(value for values in gap[CONTINUOUS].values() for value in values)]
    return [
        Statement(
            'Sec. 7',
            'Lower displacements when damping is on.',
            f'Largest displacement over that of the hydromount, sweep from 3 to 14 Hz by road level, '
            f'{told(PAPER)}. {told(CONTINUOUS)}. Holds if the continuous law is below the hydromount '
            f'everywhere.',
            Holds.YES if max(ours) < 1.0 else Holds.PARTLY,
        ),
        Statement(
            'Fig. 14; Sec. 6',
            'At higher frequencies, where damping is off, the acceleration of the chassis is lower.',
            'Of the continuous law over the mount without current, 14 to 50 Hz, road levels as above: '
            + ', '.join(f'{value:.3f}' for value in figures['high_frequency_ratio'][CONTINUOUS].values())
            + '.',
            Holds.NOT_COMPARABLE,
        ),
    ]


EXPERIMENT = Experiment(
    name=NAME,
    title=TITLE,
    reference=REFERENCE,
    summary=(
        "The paper's switched policy and the continuous law on the same roads, racks and engines, beside the "
        'hydromount and the mount without current: what each gives, and what it costs.'
    ),
    defaults=PolicyParameters(),
    run=run,
)
