"""What the comparison with the hydromount depends on: road level, decoupler, chamber, idling engine."""

import csv
import importlib.resources
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt
from matplotlib.colors import TwoSlopeNorm
from matplotlib.patheffects import withStroke

from engine_mount.drives.bands import BELOW_ISOLATION, ISOLATION_BANDS
from engine_mount.experiments.harness.closed_loop import PAPER, settings_of_run
from engine_mount.experiments.harness.contract import (
    Experiment,
    Holds,
    Order,
    Outcome,
    Progress,
    Statement,
    Values,
    numbers_of,
    parameters_of,
    write_page,
)
from engine_mount.experiments.harness.drawing import finish, new_figure
from engine_mount.experiments.harness.many_runs import Found, Job, run_all, run_job
from engine_mount.experiments.harness.measures import sweep_parameters
from engine_mount.experiments.registry import NAMES
from engine_mount.reports.drive.signals import FloatArray
from mount_control.policy.switched_viscous import DEFAULT_DAMPER
from mount_models.damper import damper_curve
from mount_models.quantity import Quantity, checked
from mount_sim.plant.hydromount import Hydromount

EVEN_WITHIN = 0.02
"""Two mounts count as even where their ratio differs from 1 by at most so much (chosen)."""


class SensitivityParameters(NamedTuple):
    """The values between which all combinations are run, separated by commas, and the common rest."""

    road_levels: str = '0.04, 0.06, 0.08, 0.10, 0.12, 0.16, 0.20'
    decoupler_resistances: str = '2e7, 5e7, 1e8, 2e8'
    chamber_asymmetries: str = '0.25, 0'
    idle_forces: str = '0, 80, 200, 400'
    last_frequency: Annotated[float, Quantity('Hz', 'end of the sweep', 14.0, 50.0, 'Sec. 6')] = 50.0
    damper: str = DEFAULT_DAMPER
    workers: Annotated[int, Quantity('1', 'processes; 0: one for each core', 0, 256)] = 0


class Axes(NamedTuple):
    """The values of the four things: m/s, Pa s/m^3, 1, N."""

    levels: list[float]
    resistances: list[float]
    asymmetries: list[float]
    idle_forces: list[float]


@dataclass(frozen=True)
class Maps:
    """Friction mount over hydromount, below 1 where the friction mount has less.

    `peak` (level, resistance, asymmetry, idle): largest displacement from 3 to 14 Hz. `rms` (band, level,
    resistance, asymmetry, idle): chassis acceleration; NaN where the sweep ends before. `friction_peak`
    (level, idle) in m. Of each (resistance, asymmetry) on the rack, `hydro_harmonics` are those of the
    hydromount in N, `below` the orders in which the friction mount is lower. `peak_as_there` {level: m} is
    the friction mount's without idle force, with the damper of the independent computation.
    """

    axes: Axes
    peak: FloatArray
    rms: FloatArray
    friction_peak: FloatArray
    below: dict[tuple[float, float], list[int]]
    hydro_harmonics: dict[tuple[float, float], list[float]]
    peak_as_there: dict[float, float]


def lower(ratios: FloatArray) -> npt.NDArray[np.bool_]:
    """Return where the friction mount has less than the hydromount, and not about the same."""
    return np.asarray(ratios < 1.0 - EVEN_WITHIN)


def higher(ratios: FloatArray) -> npt.NDArray[np.bool_]:
    """Return where the friction mount has more than the hydromount, and not about the same."""
    return np.asarray(ratios > 1.0 + EVEN_WITHIN)


def share_won(ratios: FloatArray) -> float:
    """Return the share of the known ratios in which the friction mount has less, NaN if none is known."""
    known = ratios[~np.isnan(ratios)]
    return float(np.mean(lower(known))) if known.size else float('nan')


DAMPER = {'law': 'viscous', 'damping_coefficient': 2500.0}
"""The characteristic of its sweeps, N s/m."""

NEAR = 0.03
"""Agreement means that a ratio differs by at most so much of itself (chosen)."""


def agreement(maps: Maps) -> str:
    """Return a table of those reference figures whose values are in the grid, and a sentence on them."""
    rows = list(_compared(maps))
    if not rows:
        return 'None of its values is in this grid.\n'
    agreed = sum(near for *_, near in rows)
    lines = [
        'Another program, written for this project from the same equations, gave the figures below, the '
        'displacements with a viscous damper of 2500 N s/m; so here, for this comparison, with that one too. '
        f'{agreed} of {len(rows)} agree within {100 * NEAR:.0f} % (counts: exactly). Where other figures of '
        'it differ, on rack and gap, and which of the two is wrong: [differences.md](differences.md).\n',
        '| figure | there | here | agrees |',
        '|---|---|---|---|',
    ]
    lines += [
        f'| {what} | {there} | {here} | {"yes" if near else "no"} |' for what, there, here, near in rows
    ]
    return '\n'.join(lines) + '\n'


def _compared(maps: Maps) -> Iterator[tuple[str, str, str, bool]]:
    """Yield what is compared, the figure there and here, and whether they agree."""
    text = importlib.resources.files(__package__).joinpath('sensitivity_reference.csv').read_text('utf-8')
    for row in csv.DictReader(text.splitlines()):
        figure = row.pop('figure')
        level, resistance, asymmetry, idle, band, there = map(float, row.values())
        if figure == 'harmonics':
            if (resistance, asymmetry) in maps.below:
                here = len(maps.below[resistance, asymmetry])
                what = f'lower harmonics, R_d = {resistance:.0e}, asymmetry {asymmetry:g}'
                yield what, f'{there:.0f} of 8', f'{here} of 8', here == there
            continue
        values = (level, resistance, asymmetry, idle)
        if not all(value in axis for value, axis in zip(values, maps.axes, strict=True)):
            continue
        place = tuple(axis.index(value) for value, axis in zip(values, maps.axes, strict=True))
        if figure == 'displacement':
            hydro = maps.friction_peak[place[0], place[3]] / maps.peak[place]
            ratio = float(maps.peak_as_there[level] / hydro)
            what = f'displacement, V0 = {level:g} m/s, R_d = {resistance:.0e}, F_i = {idle:g} N'
        else:
            low, high = ISOLATION_BANDS[int(band)]
            ratio = float(maps.rms[(int(band), *place)])
            what = f'acceleration, R_d = {resistance:.0e}, F_i = {idle:g} N, {low:.0f} to {high:.0f} Hz'
        if not np.isnan(ratio):
            # the reference is printed with two digits behind the point
            yield what, f'{there:.2f}', f'{ratio:.2f}', abs(ratio - there) <= NEAR * there + 0.005


NAME = 'sensitivity'
_BENCH_FREQUENCY, _BENCH_AMPLITUDE, _BENCH_SECONDS = 8.0, 1e-3, 4.75
_HIGHEST_LEVEL = 1.0  # m/s


def run(order: Order, progress: Progress) -> Outcome:
    """Run all combinations, and write maps and a page from the numbers."""

    parameters = parameters_of(order, NAME, SensitivityParameters())
    damper_curve(parameters.damper)  # refuses an unknown one before anything is run
    axes = axes_of(parameters)
    jobs = _jobs(order, parameters, axes)
    found = run_all(
        jobs,
        parameters.workers,
        lambda done: progress(0.97 * done / len(jobs), f'{done} of {len(jobs)} runs'),
        run_job,
    )
    maps = _maps(axes, found)
    progress(0.97, 'pictures')
    folder = order.out / 'figures'
    pictures = [
        draw_peaks(maps, folder / 'sensitivity_displacement.png'),
        draw_acceleration(maps, folder / 'sensitivity_acceleration.png'),
    ]
    page = write_results(maps, parameters, len(jobs), pictures, order.out / 'results.md')
    statements = _statements(maps, in_short(maps))
    return Outcome(_figures(maps, parameters, len(jobs)), pictures, [], statements, [page])


def axes_of(parameters: SensitivityParameters) -> Axes:
    """Return the values of the grid; raises `ParameterError` for a text that is no list of such numbers."""
    axes = Axes(
        numbers_of(f'{NAME}.road_levels', parameters.road_levels, 1e-3, _HIGHEST_LEVEL),
        numbers_of(f'{NAME}.decoupler_resistances', parameters.decoupler_resistances, 0.0, 1e10),
        numbers_of(f'{NAME}.chamber_asymmetries', parameters.chamber_asymmetries, 0.0, 0.9),
        numbers_of(f'{NAME}.idle_forces', parameters.idle_forces, 0.0, 2000.0),
    )
    for resistance, asymmetry in product(axes.resistances, axes.asymmetries):
        checked(Hydromount(decoupler_resistance=resistance, compliance_asymmetry=asymmetry))
    return axes


def _jobs(order: Order, parameters: SensitivityParameters, axes: Axes) -> list[Job]:
    damper, last, jobs = parameters.damper, parameters.last_frequency, []
    for level, idle in product(axes.levels, axes.idle_forces):
        sim = sweep_parameters(level, last, idle)
        jobs.append(_job(order, ('friction', level, idle), {**sim, 'mount': 'friction'}, damper))
        for resistance, asymmetry in product(axes.resistances, axes.asymmetries):
            hydro = {**sim, 'mount': 'hydro', **_hydromount(resistance, asymmetry)}
            jobs.append(_job(order, ('hydro', level, resistance, asymmetry, idle), hydro, damper))
    for level in axes.levels:
        sim = sweep_parameters(level, last)
        jobs.append(_job(order, ('friction as there', level), {**sim, 'mount': 'friction'}, DAMPER))
    jobs.append(_job(order, ('friction on the rack',), _bench('friction'), damper))
    for resistance, asymmetry in product(axes.resistances, axes.asymmetries):
        sim = _bench('hydro') | _hydromount(resistance, asymmetry)
        jobs.append(_job(order, ('hydro on the rack', resistance, asymmetry), sim, damper))
    return jobs


def _job(order: Order, key: tuple[Any, ...], sim: Values, damper: Any) -> Job:
    own = {'mount_sim': sim, 'mount_control': {'policy': PAPER, 'damper': damper}}
    return Job(key, settings_of_run(order, own, NAME))


def _bench(mount: str) -> Values:
    return {
        'scenario': 'bench',
        'mount': mount,
        'timeline.duration': _BENCH_SECONDS,
        'bench.frequency': _BENCH_FREQUENCY,
        'bench.amplitude': _BENCH_AMPLITUDE,
    }


def _hydromount(resistance: float, asymmetry: float) -> Values:
    return {
        'hydromount.decoupler_resistance': resistance,
        'hydromount.compliance_asymmetry': asymmetry,
    }


def _maps(axes: Axes, found: Found) -> Maps:
    shape = tuple(len(values) for values in axes)
    peak, rms = np.full(shape, np.nan), np.full((len(ISOLATION_BANDS), *shape), np.nan)
    friction_peak = np.full((shape[0], shape[3]), np.nan)
    for place in np.ndindex(shape):
        level, resistance, asymmetry, idle = (values[k] for values, k in zip(axes, place, strict=True))
        ours, theirs = found['friction', level, idle], found['hydro', level, resistance, asymmetry, idle]
        peak[place] = ours['peak_m'] / theirs['peak_m']
        friction_peak[place[0], place[3]] = ours['peak_m']
        for band, (a, b) in enumerate(zip(ours['rms'], theirs['rms'], strict=True)):
            if a is not None and b is not None:
                rms[(band, *place)] = a / b
    friction = np.array(found[('friction on the rack',)]['harmonics_n'])
    hydro = {
        key: found[('hydro on the rack', *key)]['harmonics_n']
        for key in product(axes.resistances, axes.asymmetries)
    }
    below = {key: _orders_below(friction, harmonics) for key, harmonics in hydro.items()}
    there = {level: found['friction as there', level]['peak_m'] for level in axes.levels}
    return Maps(axes, peak, rms, friction_peak, below, hydro, there)


def _orders_below(friction: FloatArray, hydro: list[float]) -> list[int]:
    return [k + 1 for k in range(friction.size) if friction[k] < hydro[k]]


def _figures(maps: Maps, parameters: SensitivityParameters, runs: int) -> Values:
    return {
        'runs': runs,
        'damper': parameters.damper,
        'order_of_axes': list(Axes._fields),
        **maps.axes._asdict(),
        'peak_band_hz': list(BELOW_ISOLATION),
        'peak_ratio': maps.peak.tolist(),
        'friction_peak_m': maps.friction_peak.tolist(),
        'isolation_bands_hz': [list(band) for band in ISOLATION_BANDS],
        'acceleration_ratio': [None if np.isnan(part).any() else part.tolist() for part in maps.rms],
        'lower_harmonics': [
            {'decoupler_resistance': key[0], 'chamber_asymmetry': key[1], 'orders': orders}
            for key, orders in maps.below.items()
        ],
    }


def verdict(share: float) -> Holds:
    """Return whether a claim holds that came out in a `share` of the combinations."""
    if np.isnan(share):
        return Holds.NOT_COMPARABLE
    return Holds.YES if share == 1.0 else Holds.NO if share == 0.0 else Holds.PARTLY


def _statements(maps: Maps, told: dict[str, str]) -> list[Statement]:
    full = [len(orders) == 8 for orders in maps.below.values()]
    return [
        Statement(
            'Fig. 14; Sec. 7',
            'With damping on, the displacement is smaller than with the original mount.',
            told['displacement'],
            verdict(share_won(maps.peak)),
        ),
        Statement(
            'Fig. 14; Sec. 7',
            'With damping off, the acceleration of the chassis is lower than with the original mount.',
            told['acceleration'],
            verdict(share_won(maps.rms)),
        ),
        Statement(
            'Fig. 13; Sec. 7',
            'The force is lower up to the 8th harmonic.',
            told['harmonics'],
            verdict(float(np.mean(full))),
        ),
    ]


_EVEN = (2, 4, 6, 8)
_HEAD = """# Friction mount or hydromount: what the answer depends on

The paper found its friction mount better than the original hydromount. Its text gives neither the road level
nor whether the engine ran during the sweep, and nothing about the hydromount. What is not given had to be
chosen for the simulation, and the choice decides part of the comparison. So no single scenario stands here as
evidence: this page shows all combinations. `engine-mount experiment sensitivity` writes it from the numbers;
nobody edits it.
"""
_LIMITS = """## Limits

- One simulated car, one seed, one set of all other values; hydromount and car have magnitudes as in the
  literature, not those of the authors.
- Controller and pads share the friction law, and the initialisation is that of a healthy actuator.
- The runs of the grid go through the same closed loop as `engine-mount drive --core`, but are not recorded.
  Any of them can be repeated with a recording, for instance
  `engine-mount drive --core --scenario sweep --mount hydro --set mount_sim.sweep.velocity_amplitude=0.06
  --set mount_sim.hydromount.decoupler_resistance=2e7`.
- A sweep passes each frequency once. What a mount does on a real road in a mixture of all of them, this page
  does not tell; a minute of one is in [recorded_drive.md](recorded_drive.md).
"""


def in_short(maps: Maps) -> dict[str, str]:
    """Return one plain text for each of displacement, acceleration, harmonics."""
    return {
        'displacement': _displacement(maps),
        'acceleration': _acceleration(maps),
        'harmonics': _harmonics(maps),
    }


def write_results(
    maps: Maps, parameters: SensitivityParameters, runs: int, pictures: list[Path], file: Path
) -> Path:
    """Write the page to `file` and return it; its pictures are expected in `figures/`."""
    told = in_short(maps)
    peaks, acceleration = (picture.name for picture in pictures)
    parts = [
        _HEAD,
        _varied(maps, parameters, runs),
        '## In short\n',
        '\n'.join(f'- **{name.capitalize()}.** {text}' for name, text in told.items()) + '\n',
        '## Displacement near the resonance\n',
        f'![Largest displacement, friction mount over hydromount](figures/{peaks})\n',
        _peak_table(maps),
        '## Chassis acceleration where damping is off\n',
        f'![Chassis acceleration, friction mount over hydromount](figures/{acceleration})\n',
        _share_table(maps),
        _asymmetry(maps),
        '## Harmonics on the rack, 8 Hz and 1 mm\n',
        _harmonics_table(maps),
        '## Beside an independent computation\n',
        agreement(maps),
        _LIMITS,
    ]
    return write_page(parts, file)


def _varied(maps: Maps, parameters: SensitivityParameters, runs: int) -> str:
    axes = maps.axes
    return (
        '| varied | values |\n|---|---|\n'
        f'| road level V0, vertical velocity under the wheel | {_listed(axes.levels)} m/s |\n'
        f'| resistance R_d of the decoupler | {_listed(axes.resistances)} Pa s/m^3 |\n'
        f'| asymmetry of the upper chamber C_1 | {_listed(axes.asymmetries)} |\n'
        f'| idle force F_i | {_listed(axes.idle_forces)} N |\n\n'
        f'{runs} runs; sweep from 1 to {parameters.last_frequency:g} Hz at 1 Hz/s, damper '
        f'{parameters.damper}. A ratio below 1 means that the friction mount has less; '
        f'within {100 * EVEN_WITHIN:.0f} % of 1 the two count as even (chosen). The friction mount '
        'itself does not depend on the two values of the hydromount.\n'
    )


def _displacement(maps: Maps) -> str:
    axes = maps.axes
    always = [level for k, level in enumerate(axes.levels) if lower(maps.peak[k]).all()]
    never = [level for k, level in enumerate(axes.levels) if higher(maps.peak[k]).all()]
    mixed = [level for level in axes.levels if level not in always and level not in never]
    parts = [
        'The largest displacement from 3 to 14 Hz is smaller with the friction mount than with the '
        f'hydromount in {_counted(maps.peak)} combinations'
    ]
    for levels, text in (
        (always, 'it wins whatever the rest'),
        (never, 'it loses whatever the rest'),
        (mixed, 'it depends on the rest, or they are even'),
    ):
        if levels:
            parts.append(f'at V0 = {_listed(levels)} m/s {text}')
    highest = np.unravel_index(int(np.argmax(maps.peak)), maps.peak.shape)
    lowest = np.unravel_index(int(np.argmin(maps.peak)), maps.peak.shape)
    return (
        '; '.join(parts)
        + f'. The ratio reaches from {maps.peak[lowest]:.2f} ({_where(maps, lowest)}) to '
        + f'{maps.peak[highest]:.2f} ({_where(maps, highest)}). '
        + _why(maps)
    )


def _why(maps: Maps) -> str:
    """Say by how much each mount's displacement follows the road level."""
    levels = maps.axes.levels
    if len(levels) < 2:
        return ''
    growth = maps.friction_peak[-1, 0] / maps.friction_peak[0, 0]
    hydro = maps.friction_peak / maps.peak[:, 0, 0, :]
    return (
        f'From V0 = {levels[0]:g} to {levels[-1]:g} m/s the largest displacement grows by a factor of '
        f'{growth:.1f} with the friction mount and {hydro[-1, 0] / hydro[0, 0]:.1f} with the hydromount '
        '(first values of the rest): the switched mount first lets the engine move up to its switch-on level.'
    )


def _acceleration(maps: Maps) -> str:
    axes = maps.axes
    rms = maps.rms[~np.isnan(maps.rms).any(axis=(1, 2, 3, 4))]
    if not len(rms):
        return 'The sweep ends before 20 Hz.'
    forces = [f'F_i = {f:g} N: {_counted(rms[..., k])}' for k, f in enumerate(axes.idle_forces)]
    decouplers = [f'R_d = {r:.0e}: {_counted(rms[:, :, k])}' for k, r in enumerate(axes.resistances)]
    bands = ', '.join(f'{low:.0f} to {high:.0f}' for low, high in ISOLATION_BANDS[: len(rms)])
    return (
        f'In the bands {bands} Hz the chassis has less acceleration with the friction mount in '
        f'{_counted(rms)} combinations of a band and the rest (ratio {_range(rms)}). By idle force, '
        f'{"; ".join(forces)}. By decoupler, {"; ".join(decouplers)}. {_extremes(maps)}'
    )


def _extremes(maps: Maps) -> str:
    known = np.nanmean(maps.rms, axis=0)
    best = np.unravel_index(int(np.nanargmin(known)), known.shape)
    worst = np.unravel_index(int(np.nanargmax(known)), known.shape)
    return (
        f'On the mean over the bands it is best for the friction mount at {_where(maps, best)} '
        f'({known[best]:.2f}), worst at {_where(maps, worst)} ({known[worst]:.2f}).'
    )


def _harmonics(maps: Maps) -> str:
    texts = []
    for asymmetry in maps.axes.asymmetries:
        counts = [
            f'{len(orders)} of 8 at R_d = {key[0]:.0e}'
            for key, orders in maps.below.items()
            if key[1] == asymmetry
        ]
        texts.append(f'chamber asymmetry {asymmetry:g}: {", ".join(counts)}')
    odd = [key for key, orders in maps.below.items() if not {1, 3, 5, 7} <= set(orders)]
    lost = (
        'The odd ones are lower everywhere'
        if not odd
        else f'An odd one is not lower at {"; ".join(f"R_d = {r:.0e}, asymmetry {a:g}" for r, a in odd)}'
    )
    return f'Number of harmonics in which the friction mount is lower: {"; ".join(texts)}. {lost}.'


def _where(maps: Maps, place: tuple[np.intp, ...]) -> str:
    level, resistance, asymmetry, idle = (values[int(k)] for values, k in zip(maps.axes, place, strict=True))
    return f'V0 = {level:g} m/s, R_d = {resistance:.0e}, asymmetry {asymmetry:g}, F_i = {idle:g} N'


def _peak_table(maps: Maps) -> str:
    axes = maps.axes
    lines = _head(
        "Over all decouplers and chambers: the friction mount's largest displacement, and the range of its "
        'ratio to the hydromount.',
        'V0 (m/s)',
        [f'F_i = {force:g} N' for force in axes.idle_forces],
    )
    for k, level in enumerate(axes.levels):
        cells = [
            f'{1e3 * maps.friction_peak[k, i]:.2f} mm; {_range(maps.peak[k, :, :, i])}'
            for i in range(len(axes.idle_forces))
        ]
        lines.append(f'| {level:g} | ' + ' | '.join(cells) + ' |')
    return '\n'.join(lines) + '\n'


def _share_table(maps: Maps) -> str:
    axes = maps.axes
    lines = _head(
        'Over all road levels, decouplers and chambers: in how many the friction mount is lower, and the '
        'range of the ratio.',
        'band',
        [f'F_i = {force:g} N' for force in axes.idle_forces],
    )
    for band, (low, high) in enumerate(ISOLATION_BANDS):
        cells = []
        for i in range(len(axes.idle_forces)):
            ratios = maps.rms[band, ..., i]
            cells.append('not reached' if np.isnan(ratios).any() else f'{_counted(ratios)}; {_range(ratios)}')
        lines.append(f'| {low:.0f} to {high:.0f} Hz | ' + ' | '.join(cells) + ' |')
    return '\n'.join(lines) + '\n'


def _asymmetry(maps: Maps) -> str:
    """Say how much the chamber's asymmetry moves the ratios of the sweep."""
    if len(maps.axes.asymmetries) < 2:
        return ''
    peak, rms = np.ptp(maps.peak, axis=2), np.ptp(maps.rms, axis=3)
    told = '' if np.isnan(rms).all() else f', those of the acceleration by at most {np.nanmax(rms):.2f}'
    return (
        f'Between the asymmetries of the chamber ({_listed(maps.axes.asymmetries)}) the ratios of the '
        f'displacement differ by at most {peak.max():.2f}{told}.\n'
    )


def _harmonics_table(maps: Maps) -> str:
    axes = maps.axes
    lines = _head(
        'Harmonics in which the friction mount is lower.',
        'R_d (Pa s/m^3)',
        [f'asymmetry {value:g}' for value in axes.asymmetries],
    )
    for resistance in axes.resistances:
        cells = [_orders(maps.below[resistance, asymmetry]) for asymmetry in axes.asymmetries]
        lines.append(f'| {resistance:.0e} | ' + ' | '.join(cells) + ' |')
    even = [f'{_largest_even(maps, value):.2f} N with asymmetry {value:g}' for value in axes.asymmetries]
    lines.append(
        f'\nThe largest even harmonic of the hydromount is {", ".join(even)}. The asymmetry was put into its '
        'model so that there are even harmonics; an advantage in them is therefore no finding.'
    )
    return '\n'.join(lines) + '\n'


def _head(sentence: str, first: str, columns: list[str]) -> list[str]:
    """Return the first lines of a table under a sentence."""
    return [f'{sentence}\n', f'| {first} | ' + ' | '.join(columns) + ' |', '|---|' + '---|' * len(columns)]


def _largest_even(maps: Maps, asymmetry: float) -> float:
    found = [each for key, each in maps.hydro_harmonics.items() if key[1] == asymmetry]
    return max(each[order - 1] for each in found for order in _EVEN)


def _orders(orders: list[int]) -> str:
    return 'all 8' if len(orders) == 8 else ', '.join(str(order) for order in orders) or 'none'


def _counted(ratios: FloatArray) -> str:
    won, lost = int(np.sum(lower(ratios))), int(np.sum(higher(ratios)))
    even = ratios.size - won - lost
    return f'{won} of {ratios.size}' + (f' ({even} even)' if even else '')


def _range(ratios: FloatArray) -> str:
    return f'{ratios.min():.2f} to {ratios.max():.2f}'


def _listed(values: list[float]) -> str:
    return ', '.join(f'{value:g}' for value in values)


_COLOURS = 'RdBu_r'  # red: the friction mount has more


def nearest(values: list[float], wanted: float) -> int:
    """Return the place of the value next to the wanted one."""
    return int(np.argmin(np.abs(np.array(values) - wanted)))


def draw_peaks(maps: Maps, file: Path) -> Path:
    """Draw the displacement's ratio over road level and decoupler, one map for each idle force."""
    axes_of_maps = maps.axes
    asymmetry = nearest(axes_of_maps.asymmetries, 0.25)
    count = len(axes_of_maps.idle_forces)
    columns = min(count, 2)
    rows = -(-count // columns)
    figure = new_figure(
        'Largest displacement from 3 to 14 Hz: friction mount over hydromount\n'
        f'chamber asymmetry {axes_of_maps.asymmetries[asymmetry]:g}; black line: even', 1.2 + 2.8 * rows
    )  # fmt: skip
    panels = np.atleast_1d(figure.subplots(rows, columns, sharex=True, sharey=True)).ravel()
    for number, panel in enumerate(panels):
        if number >= count:
            panel.set_visible(False)
            continue
        _draw_map(
            panel,
            maps.peak[:, :, asymmetry, number].T,
            [f'{level:g}' for level in axes_of_maps.levels],
            [f'{resistance:.0e}' for resistance in axes_of_maps.resistances],
        )
        panel.set_title(f'idle force {axes_of_maps.idle_forces[number]:g} N', fontsize='medium')
        panel.set_xlabel('road level V0 (m/s)')
        panel.set_ylabel('decoupler R_d (Pa s/m$^3$)')
    return _finish_maps(figure, file)


def draw_acceleration(maps: Maps, file: Path) -> Path:
    """Draw the acceleration's ratio in each band: over decoupler and idle force, over road level and it."""
    axes_of_maps = maps.axes
    asymmetry = nearest(axes_of_maps.asymmetries, 0.25)
    level, resistance = nearest(axes_of_maps.levels, 0.12), nearest(axes_of_maps.resistances, 1e8)
    forces = [f'{force:g}' for force in axes_of_maps.idle_forces]
    figure = new_figure(
        'Chassis acceleration (rms): friction mount over hydromount\n'
        f'chamber asymmetry {axes_of_maps.asymmetries[asymmetry]:g}; black line: even', 7.2
    )  # fmt: skip
    panels = figure.subplots(2, len(ISOLATION_BANDS))
    for band, (low, high) in enumerate(ISOLATION_BANDS):
        above, below = panels[:, band]
        _draw_map(
            above,
            maps.rms[band, level, :, asymmetry, :],
            forces,
            [f'{value:.0e}' for value in axes_of_maps.resistances],
        )
        above.set_title(
            f'{low:.0f} to {high:.0f} Hz, V0 = {axes_of_maps.levels[level]:g} m/s', fontsize='medium'
        )
        _draw_map(
            below,
            maps.rms[band, :, resistance, asymmetry, :],
            forces,
            [f'{value:g}' for value in axes_of_maps.levels],
        )
        below.set_title(
            f'{low:.0f} to {high:.0f} Hz, R_d = {axes_of_maps.resistances[resistance]:.0e}', fontsize='medium'
        )
        for panel in (above, below):
            panel.set_xlabel('idle force F_i (N)')
    panels[0, 0].set_ylabel('decoupler R_d (Pa s/m$^3$)')
    panels[1, 0].set_ylabel('road level V0 (m/s)')
    return _finish_maps(figure, file)


def _draw_map(panel: Any, ratios: FloatArray, across: list[str], upwards: list[str]) -> None:
    """Draw ratios (upwards, across) as colours with their numbers, and a line where they are 1."""
    panel.imshow(
        ratios, cmap=_COLOURS, norm=TwoSlopeNorm(1.0, 0.4, 2.0), origin='lower', aspect='auto', alpha=0.85
    )
    panel.set_xticks(range(len(across)), across)
    panel.set_yticks(range(len(upwards)), upwards)
    for row, column in np.ndindex(ratios.shape):
        value = ratios[row, column]
        text = '-' if np.isnan(value) else f'{value:.2f}'
        written = panel.text(column, row, text, ha='center', va='center', fontsize='small', zorder=4)
        if lower(value):
            written.set_weight('bold')
        written.set_path_effects([withStroke(linewidth=2.5, foreground='white', alpha=0.7)])
    if min(ratios.shape) > 1 and np.nanmin(ratios) < 1.0 < np.nanmax(ratios):
        panel.contour(ratios, levels=[1.0], colors='black', linewidths=1.8)


def _finish_maps(figure: Any, file: Path) -> Path:
    figure.supxlabel(
        'bold, blue: the friction mount has less; red: the hydromount has less', fontsize='small'
    )
    return finish(figure, file, grid=False)


EXPERIMENT = Experiment(
    NAME,
    *NAMES[NAME],
    (
        'The paper gives neither the road level nor whether the engine ran, and nothing of its hydromount. '
        'So the sweep is run with all combinations of road level, resistance of the decoupler, asymmetry of '
        'the upper chamber and idle force, and the rack with those of the hydromount; every run goes through '
        'the same closed loop as a drive, but is not recorded. *partly* means: in some of the combinations.'
    ),
    SensitivityParameters(),
    run,
)
