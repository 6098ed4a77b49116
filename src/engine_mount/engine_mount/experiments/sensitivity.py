"""Influences on the comparison with the hydromount: road level, decoupler, chamber, idling engine."""

from itertools import product
from typing import Annotated, Any, NamedTuple

import numpy as np
from matplotlib.colors import TwoSlopeNorm
from matplotlib.patheffects import withStroke

from engine_mount.experiments.harness.closed_loop import Case, run_cases, settings_of_run
from engine_mount.experiments.harness.drawing import new_panels
from engine_mount.experiments.harness.experiment import (
    EVEN,
    NOT_COMPARABLE,
    PAPER,
    Experiment,
    Findings,
    Order,
    Values,
    Workers,
    claim,
    holds_if,
    in_one_line,
    numbers_of,
    table,
)
from engine_mount.experiments.harness.measures import (
    BELOW_ISOLATION,
    ISOLATION_BANDS,
    peak_and_rms,
    sweep_parameters,
)
from engine_mount.reports.drive.signals import FloatArray, Truth
from engine_mount.reports.sections.periodic import harmonics, whole_periods
from mount_control.policy.switched_viscous import DEFAULT_DAMPER
from mount_models.quantity import Quantity, checked
from mount_sim.parameters import SimParameters
from mount_sim.plant.hydromount import Hydromount

NAME = 'sensitivity'
ORDERS = 8
_RACK = {'scenario': 'bench', 'timeline.duration': 4.75, 'bench.frequency': 8.0, 'bench.amplitude': 1e-3}
_PERIODS = 16  # evaluated on the rack
_SHOWN_LEVEL = 0.12  # m/s, or the next one to it
_BAND_NAMES = [f'{low:.0f} to {high:.0f}' for low, high in ISOLATION_BANDS]


class SensitivityParameters(NamedTuple):
    """The values between which all combinations are run, separated by commas, and the common rest."""

    road_levels: str = '0.04, 0.06, 0.08, 0.10, 0.12, 0.16, 0.20'
    decoupler_resistances: str = '2e7, 5e7, 1e8, 2e8'
    chamber_asymmetries: str = '0.25, 0'
    idle_forces: str = '0, 80, 200, 400'
    last_frequency: Annotated[float, Quantity('Hz', 'end of the sweep', 14.0, 50.0, 'Sec. 6')] = 50.0
    damper: str = DEFAULT_DAMPER
    workers: Workers = 0


class Axes(NamedTuple):
    """The values of the four things: m/s, Pa s/m^3, 1, N."""

    levels: list[float]
    resistances: list[float]
    asymmetries: list[float]
    idle_forces: list[float]


class Maps(NamedTuple):
    """Friction mount over hydromount, below 1 where the friction mount has less.

    `peak` (level, resistance, asymmetry, idle): largest displacement from 3 to 14 Hz. `rms` (band, level,
    resistance, asymmetry, idle): chassis acceleration; NaN where the sweep ends before. `friction_peak`
    (level, idle) in m. `below` are the harmonics on the rack in which the friction mount is lower, of each
    (resistance, asymmetry).
    """

    axes: Axes
    peak: FloatArray
    rms: FloatArray
    friction_peak: FloatArray
    below: dict[tuple[float, float], list[int]]


def run(order: Order) -> Findings:
    """Run all combinations, and make maps and a page from the numbers."""
    axes = Axes(
        numbers_of(order, 'road_levels', 1e-3, 1.0),
        numbers_of(order, 'decoupler_resistances', 0.0, 1e10),
        numbers_of(order, 'chamber_asymmetries', 0.0, 0.9),
        numbers_of(order, 'idle_forces', 0.0, 2000.0),
    )
    cases = cases_of(order, axes)
    maps = maps_of(axes, run_cases(order, cases))
    figures = {
        'runs': len(cases),
        'damper': order.parameters.damper,
        'order_of_axes': list(Axes._fields),
        **axes._asdict(),
        'peak_band_hz': list(BELOW_ISOLATION),
        'peak_ratio': maps.peak.tolist(),
        'friction_peak_m': maps.friction_peak.tolist(),
        'isolation_bands_hz': [list(band) for band in ISOLATION_BANDS],
        'acceleration_ratio': [None if np.isnan(part).any() else part.tolist() for part in maps.rms],
        'lower_harmonics': [
            {'decoupler_resistance': resistance, 'chamber_asymmetry': asymmetry, 'orders': orders}
            for (resistance, asymmetry), orders in maps.below.items()
        ],
    }
    pictures = {
        'sensitivity_displacement': draw_peaks(maps),
        'sensitivity_acceleration': draw_acceleration(maps),
    }
    pages = {'results.md': page_of(maps, order.parameters, len(cases))}
    return Findings(figures, pictures, pages=pages, judged=maps)


def cases_of(order: Order, axes: Axes) -> dict[tuple[Any, ...], Case]:
    """Return all runs: sweeps of both mounts, and the rack."""
    own, cases = order.parameters, {}

    def add(key: tuple[Any, ...], sim: Values, mount: str) -> None:
        control = {'policy': PAPER, 'damper': own.damper}
        figures = rack_harmonics if sim['scenario'] == 'bench' else peak_and_rms
        cases[key] = Case(settings_of_run(order, {**sim, 'mount': mount}, control), figures)

    hydromounts = {}
    for key in product(axes.resistances, axes.asymmetries):
        checked(Hydromount(decoupler_resistance=key[0], compliance_asymmetry=key[1]))
        names = ('hydromount.decoupler_resistance', 'hydromount.compliance_asymmetry')
        hydromounts[key] = dict(zip(names, key, strict=True))
    for level, idle in product(axes.levels, axes.idle_forces):
        sim = sweep_parameters(level, own.last_frequency, idle)
        add(('friction', level, idle), sim, 'friction')
        for key, hydro in hydromounts.items():
            add(('hydro', level, *key, idle), sim | hydro, 'hydro')
    add(('rack',), _RACK, 'friction')
    for key, hydro in hydromounts.items():
        add(('rack', *key), _RACK | hydro, 'hydro')
    return cases


def rack_harmonics(truth: Truth, sim: SimParameters) -> Values:
    """Return the harmonics of the mount force (N) on the rack."""
    frequency = sim.bench.frequency
    part, _ = whole_periods(truth.time, frequency, _PERIODS)
    return {'harmonics_n': harmonics(truth.time[part], truth.mount_force[part], frequency, ORDERS).tolist()}


def maps_of(axes: Axes, found: dict[tuple[Any, ...], Values]) -> Maps:
    """Return the ratios of the mounts, from the figures of all runs."""

    def grid(what: str, mount: str, *along: list[float]) -> FloatArray:
        values = [found[(mount, *key)][what] for key in product(*along)]
        return np.array(values, float).reshape(*map(len, along), *np.shape(values)[1:])

    def ratio(what: str) -> FloatArray:
        ours = grid(what, 'friction', axes.levels, axes.idle_forces)
        return ours[:, np.newaxis, np.newaxis] / grid(what, 'hydro', *axes)

    friction = found[('rack',)]['harmonics_n']
    hydro = {key: found['rack', *key]['harmonics_n'] for key in product(axes.resistances, axes.asymmetries)}
    return Maps(
        axes,
        ratio('peak_m'),
        np.moveaxis(ratio('rms'), -1, 0),
        grid('peak_m', 'friction', axes.levels, axes.idle_forces),
        {key: [k + 1 for k in range(ORDERS) if friction[k] < each[k]] for key, each in hydro.items()},
    )


def lower(ratios: FloatArray) -> Any:
    """Return where the friction mount has less than the hydromount, and not about the same."""
    return ratios < 1.0 - EVEN


def higher(ratios: FloatArray) -> Any:
    """Return where the friction mount has more than the hydromount, and not about the same."""
    return ratios > 1.0 + EVEN


@claim('Fig. 14; Sec. 7', paper='With damping on, the displacement is smaller than with the original mount.')
def displacement(maps):
    """Return where the friction mount moves less, and by how much displacements follow the road level."""
    levels = maps.axes.levels
    always, never = (
        [level for level, ratios in zip(levels, maps.peak, strict=True) if clear(ratios).all()]
        for clear in (lower, higher)
    )
    parts = [
        f"""The largest displacement from 3 to 14 Hz is smaller with the friction mount than with the
        hydromount in {_counted(maps.peak)} combinations (ratio {_range(maps.peak)})"""
    ]
    for chosen, text in (
        (always, 'it always wins'),
        (never, 'it always loses'),
        (
            [level for level in levels if level not in (*always, *never)],
            'it depends on the rest, or they are even',
        ),
    ):
        if chosen:
            parts.append(f'at V0 = {_listed(chosen)} m/s {text}')
    friction = maps.friction_peak[:, 0]
    hydro = friction / maps.peak[:, 0, 0, 0]
    ours, its = (each[-1] / each[0] for each in (friction, hydro))
    told = f"""{'; '.join(parts)}. From V0 = {levels[0]:g} to {levels[-1]:g} m/s the largest displacement
        grows by a factor of {ours:.1f} with the friction mount and {its:.1f} with the hydromount (first
        values of the rest): the switched mount first lets the engine move up to its switch-on level."""
    return holds_if(lower(maps.peak).ravel().tolist()), told


@claim(
    'Fig. 14; Sec. 7',
    paper='With damping off, the acceleration of the chassis is lower than with the original mount.',
)
def acceleration(maps):
    """Return in how many combinations the chassis has less acceleration."""
    rms = maps.rms[~np.isnan(maps.rms).any(axis=(1, 2, 3, 4))]
    if not len(rms):
        return NOT_COMPARABLE, 'The sweep ends before 20 Hz.'
    forces = [f'F_i = {f:g} N: {_counted(rms[..., k])}' for k, f in enumerate(maps.axes.idle_forces)]
    decouplers = [f'R_d = {r:.0e}: {_counted(rms[:, :, k])}' for k, r in enumerate(maps.axes.resistances)]
    told = f"""In the bands {', '.join(_BAND_NAMES[: len(rms)])} Hz the chassis has less acceleration with the
        friction mount in {_counted(rms)} combinations of a band and the rest (ratio {_range(rms)}). By idle
        force, {'; '.join(forces)}. By decoupler, {'; '.join(decouplers)}."""
    return holds_if(lower(rms).ravel().tolist()), told


@claim('Fig. 13; Sec. 7', paper='The force is lower up to the 8th harmonic.')
def force_harmonics(maps):
    """Return the number of harmonics in which the friction mount is lower."""
    counts = [
        f'{len(orders)} of {ORDERS} at R_d = {resistance:.0e}, asymmetry {asymmetry:g}'
        for (resistance, asymmetry), orders in maps.below.items()
    ]
    told = f'Number of harmonics in which the friction mount is lower: {"; ".join(counts)}.'
    return holds_if([len(orders) == ORDERS for orders in maps.below.values()]), told


def _counted(ratios: FloatArray) -> str:
    won, lost = int(np.sum(lower(ratios))), int(np.sum(higher(ratios)))
    even = ratios.size - won - lost
    return f'{won} of {ratios.size}' + (f' ({even} even)' if even else '')


def _range(ratios: FloatArray) -> str:
    return f'{ratios.min():.2f} to {ratios.max():.2f}'


def _listed(values: list[float]) -> str:
    return ', '.join(f'{value:g}' for value in values)


def _orders(orders: list[int]) -> str:
    return f'all {ORDERS}' if len(orders) == ORDERS else ', '.join(map(str, orders)) or 'none'


def page_of(maps: Maps, own: SensitivityParameters, runs: int) -> str:
    """Return the page."""
    axes = maps.axes
    forces = [f'F_i = {force:g} N' for force in axes.idle_forces]
    columns = range(len(forces))
    peaks = [
        (f'{level:g}', *(f'{1e3 * peak[i]:.2f} mm; {_range(ratios[..., i])}' for i in columns))
        for level, peak, ratios in zip(axes.levels, maps.friction_peak, maps.peak, strict=True)
    ]
    shares = [
        (f'{name} Hz', *(f'{_counted(rms[..., i])}; {_range(rms[..., i])}' for i in columns))
        for name, rms in zip(_BAND_NAMES, maps.rms, strict=True)
        if not np.isnan(rms).any()
    ]
    lower_ones = [
        (f'{resistance:.0e}', *(_orders(maps.below[resistance, each]) for each in axes.asymmetries))
        for resistance in axes.resistances
    ]
    said = {'Displacement': displacement, 'Acceleration': acceleration, 'Harmonics': force_harmonics}
    in_short = '\n'.join(f'- **{name}.** {in_one_line(judge(maps)[1])}' for name, judge in said.items())
    return f"""# Friction mount or hydromount: what the answer depends on

The paper found its friction mount better than the original hydromount. Its text gives neither the road level
nor whether the engine ran during the sweep, and nothing about the hydromount. This project chose the
missing values for the simulation, and the choice decides part of the comparison. So no single scenario serves
as evidence: this page shows all combinations. `engine-mount experiment sensitivity` writes the page from the
numbers; do not edit it.

| varied | values |
|---|---|
| road level V0, vertical velocity under the wheel | {_listed(axes.levels)} m/s |
| resistance R_d of the decoupler | {_listed(axes.resistances)} Pa s/m^3 |
| asymmetry of the upper chamber C_1 | {_listed(axes.asymmetries)} |
| idle force F_i | {_listed(axes.idle_forces)} N |

{runs} runs; sweep from 1 to {own.last_frequency:g} Hz at 1 Hz/s, damper {own.damper}. A ratio below 1 \
means that the friction mount has less; within {100 * EVEN:.0f} % of 1 the two count as even \
(chosen). The friction mount itself does not depend on the two values of the hydromount.

## In short

{in_short}

## Displacement near the resonance

![Largest displacement, friction mount over hydromount](figures/sensitivity_displacement.png)

Over all decouplers and chambers: the friction mount's largest displacement, and the range of its ratio to \
the hydromount.

{table(('V0 (m/s)', *forces), peaks)}
## Chassis acceleration where damping is off

![Chassis acceleration, friction mount over hydromount](figures/sensitivity_acceleration.png)

Over all road levels, decouplers and chambers: the number of cases in which the friction mount is lower, and \
the range of the ratio.

{table(('band', *forces), shares)}
## Harmonics on the rack, 8 Hz and 1 mm

Harmonics in which the friction mount is lower.

{table(('R_d (Pa s/m^3)', *(f'asymmetry {value:g}' for value in axes.asymmetries)), lower_ones)}
The model of the hydromount contains the asymmetry so that there are even harmonics; an advantage in them \
is therefore no finding.

## Limits

- One simulated car, one seed, one set of all other values; hydromount and car have magnitudes as in the
  literature, not those of the authors.
- Controller and pads share the friction law, and the initialisation is that of a healthy actuator.
- The runs of the grid go through the same closed loop as `engine-mount drive --core`, but are not recorded.
  Any of them can be repeated with a recording, for instance
  `engine-mount drive --core --scenario sweep --mount hydro --set mount_sim.sweep.velocity_amplitude=0.06
  --set mount_sim.hydromount.decoupler_resistance=2e7`.
- A sweep passes each frequency once. This page does not show a real road with a mixture of all frequencies;
  [recorded_drive.md](recorded_drive.md) shows a minute of one.
"""


def draw_peaks(maps: Maps) -> Any:
    """Draw the displacement's ratio over road level and decoupler, one map for each idle force."""
    axes, cells = maps.axes, np.moveaxis(maps.peak[:, :, 0], -1, 0)
    titles = [f'idle force {force:g} N' for force in axes.idle_forces]
    return draw_maps(
        f'Largest displacement from 3 to 14 Hz{_over(axes)}',
        dict(zip(titles, cells.swapaxes(1, 2), strict=True)),
        'road level V0 (m/s)',
        axes.levels,
        axes.resistances,
    )


def draw_acceleration(maps: Maps) -> Any:
    """Draw the acceleration's ratio over idle force and decoupler, one map for each band."""
    axes = maps.axes
    level = int(np.argmin(np.abs(np.array(axes.levels) - _SHOWN_LEVEL)))
    titles = [f'{name} Hz, V0 = {axes.levels[level]:g} m/s' for name in _BAND_NAMES]
    return draw_maps(
        f'Chassis acceleration (rms){_over(axes)}',
        dict(zip(titles, maps.rms[:, level, :, 0], strict=True)),
        'idle force F_i (N)',
        axes.idle_forces,
        axes.resistances,
    )


def _over(axes: Axes) -> str:
    return f': friction mount over hydromount\nchamber asymmetry {axes.asymmetries[0]:g}; black line: even'


def draw_maps(
    title: str, maps: dict[str, FloatArray], across: str, values: list[float], resistances: list[float]
) -> Any:
    """Draw ratios (resistance, value) as colours with their numbers, and a line where they are 1."""
    columns = min(len(maps), 2)
    rows = -(-len(maps) // columns)
    figure, panels = new_panels(title, rows, columns, 1.2 + 2.8 * rows, squeeze=False)
    for panel in panels.flat[len(maps) :]:
        panel.set_visible(False)
    for panel, (name, ratios) in zip(panels.flat, maps.items(), strict=False):
        panel.imshow(
            # red: the friction mount has more
            ratios, cmap='RdBu_r', norm=TwoSlopeNorm(1.0, 0.4, 2.0), origin='lower', aspect='auto', alpha=0.85
        )  # fmt: skip
        panel.set_xticks(range(len(values)), [f'{value:g}' for value in values])
        panel.set_yticks(range(len(resistances)), [f'{value:.0e}' for value in resistances])
        panel.set_title(name, fontsize='medium')
        panel.set(xlabel=across, ylabel='decoupler R_d (Pa s/m$^3$)')
        for (row, column), value in np.ndenumerate(ratios):
            text = '-' if np.isnan(value) else f'{value:.2f}'
            written = panel.text(column, row, text, ha='center', va='center', fontsize='small', zorder=4)
            if lower(value):
                written.set_weight('bold')
            written.set_path_effects([withStroke(linewidth=2.5, foreground='white', alpha=0.7)])
        if min(ratios.shape) > 1 and np.nanmin(ratios) < 1.0 < np.nanmax(ratios):
            panel.contour(ratios, levels=[1.0], colors='black', linewidths=1.8)
    figure.supxlabel(
        'bold, blue: the friction mount has less; red: the hydromount has less', fontsize='small'
    )
    return figure


EXPERIMENT = Experiment(
    NAME,
    """The paper gives neither the road level nor whether the engine ran, and nothing of its hydromount.
    So the sweep is run with all combinations of road level, resistance of the decoupler, asymmetry of
    the upper chamber and idle force, and the rack with those of the hydromount; every run goes through
    the same closed loop as a drive, but is not recorded. *partly* means: in some of the combinations.""",
    SensitivityParameters(),
    run,
    policies=(PAPER,),
)
