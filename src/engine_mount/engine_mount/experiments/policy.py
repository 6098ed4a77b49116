"""Policies side by side: sweep, gap, rack, roads, other engines, idle, wear; and what no policy can beat."""

import math
from pathlib import Path

import numpy as np

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
)
from engine_mount.experiments.harness.drawing import BLUE, GREY, finish, new_figure
from engine_mount.experiments.harness.many_runs import Found, run_all
from engine_mount.experiments.harness.measures import FIRST_FREQUENCY, RATE
from engine_mount.experiments.policy_cases import (
    COMPARED,
    CONTINUOUS,
    HYDRO,
    NAME,
    OFF,
    PAPER,
    Axes,
    PolicyParameters,
    jobs_of,
)
from engine_mount.experiments.policy_figures import figures_of
from engine_mount.experiments.policy_page import write_policy
from engine_mount.experiments.policy_runs import run_policy_job
from engine_mount.experiments.registry import NAMES
from engine_mount.reports.drawing.style import COLOUR_OF
from engine_mount.reports.drive.signals import FloatArray
from mount_control import band_pass
from mount_control.policy import continuous_viscous, switched_viscous
from mount_models.sampling import SAMPLE_TIME


def run(order: Order, progress: Progress) -> Outcome:
    """Run all combinations, and write pictures and a page from the numbers."""

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
    pictures = draw_all(found, figures, axes, order.out / 'figures')
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


def statements(figures: Values) -> list[Statement]:
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


_COLOURS = {
    CONTINUOUS: COLOUR_OF['continuous_viscous'],
    PAPER: COLOUR_OF['switched_viscous'],
    HYDRO: COLOUR_OF['hydro'],
    OFF: COLOUR_OF['undamped'],
}
_GAP_TIME, _BEFORE, _AFTER = 2.0, 0.05, 0.8  # s


def draw_all(found: Found, figures: Values, axes: Axes, folder: Path) -> list[Path]:
    """Draw what there is to draw and return the pictures."""
    pictures = [draw_velocity(folder / 'policy_velocity.png')]
    swept = sorted({key[2] for key, each in found.items() if key[0] == 'sweep' and 'displacement' in each})
    if swept:
        pictures.append(draw_sweeps(found, swept, folder / 'policy_sweep.png'))
    crossed = sorted({key[2:] for key, each in found.items() if key[0] == 'gap' and 'displacement' in each})
    if crossed:
        pictures.append(draw_gap(found, crossed[0], folder / 'policy_gap.png'))
    if ('road', OFF, 'recorded', 0.0) in found:
        pictures.append(draw_spectra(found, figures['idle_amplitude_n'], folder / 'policy_recorded.png'))
    if 'front' in figures:
        pictures.append(draw_front(figures['front'], folder / 'policy_front.png'))
    return pictures


def draw_sweeps(found: Found, levels: list[float], file: Path) -> Path:
    """Draw the largest displacement in each half hertz, for all policies and mounts."""
    figure = new_figure('Front wheels on a sweep: largest displacement by policy', 3.2 * len(levels))
    panels = np.atleast_1d(figure.subplots(len(levels), 1, sharex=True))
    for panel, level in zip(panels, levels, strict=True):
        for who in COMPARED:
            displacement = found['sweep', who, level, 0.0]['displacement']
            frequency = FIRST_FREQUENCY + RATE * SAMPLE_TIME * np.arange(displacement.size)
            shown = frequency < 20.0
            bins = np.floor(2.0 * frequency[shown]).astype(int)
            starts = np.flatnonzero(np.diff(bins, prepend=bins[0] - 1))
            highest = np.maximum.reduceat(np.abs(displacement[shown]), starts)
            middle = 0.5 * bins[starts] + 0.25
            panel.plot(middle, 1e3 * highest, color=_COLOURS[who], linestyle=_dash(who), label=who)
        panel.set_ylabel('largest displacement (mm)')
        panel.set_title(f'V0 = {level:g} m/s', fontsize='medium')
    panels[0].legend()
    panels[-1].set_xlabel('frequency of the road (Hz)')
    return finish(figure, file)


def draw_gap(found: Found, place: tuple[float, int], file: Path) -> Path:
    """Draw the displacement over one gap, undamped in grey."""
    depth, seed = place
    figure = new_figure(f'Over a gap of {1e3 * depth:g} mm in the motorway')
    panel = figure.subplots()
    for who in (OFF, HYDRO, PAPER, CONTINUOUS):
        displacement = found['gap', who, depth, seed]['displacement']
        time = SAMPLE_TIME * np.arange(displacement.size) - _GAP_TIME
        shown = (time >= -_BEFORE) & (time <= _AFTER)
        panel.plot(
            time[shown], 1e3 * displacement[shown], color=_COLOURS[who], linestyle=_dash(who),
            linewidth=1.8 if who == CONTINUOUS else 1.1, label=who,
        )  # fmt: skip
    panel.set_xlabel('time from the gap on (s)')
    panel.set_ylabel('displacement (mm)')
    panel.legend()
    return finish(figure, file)


def draw_velocity(file: Path) -> Path:
    """Draw what both policies take for the velocity over the true one, with the delay of the loop."""
    frequency = np.geomspace(2.0, 60.0, 300)
    figure = new_figure('Velocity that the policy takes, over the true one when its force acts', 6.0)
    upper, lower = figure.subplots(2, 1, sharex=True)
    for who, response in (
        (PAPER, _response_of_paper(frequency)),
        (CONTINUOUS, _response_of_continuous(frequency)),
    ):
        upper.plot(frequency, np.abs(response), color=_COLOURS[who], label=who)
        lower.plot(frequency, np.degrees(np.unwrap(np.angle(response))), color=_COLOURS[who], label=who)
    upper.set_ylabel('gain')
    lower.set_ylabel('phase (degrees)')
    lower.set_xlabel('frequency (Hz)')
    lower.set_xscale('log')
    lower.set_xticks([2, 4, 6, 8, 11, 20, 36, 60], ['2', '4', '6', '8', '11', '20', '36', '60'])
    lower.set_xticks([], minor=True)
    upper.legend()
    return finish(figure, file)


def _response_of_paper(frequency: FloatArray) -> FloatArray:
    law = switched_viscous.design(switched_viscous.Parameters(), SAMPLE_TIME).law.band
    z = np.exp(2j * np.pi * frequency * SAMPLE_TIME)
    band = _band_response(law, z)
    velocity = law.from_velocity * band * (1.0 - 1.0 / z) / SAMPLE_TIME + law.from_displacement * band
    return velocity / _true(frequency, switched_viscous.Parameters().lead_time)


def _response_of_continuous(frequency: FloatArray) -> FloatArray:
    """Without an idle line."""
    law = continuous_viscous.design(continuous_viscous.Parameters(), SAMPLE_TIME).law
    z = np.exp(2j * np.pi * frequency * SAMPLE_TIME)
    beta = law.beta_rate * SAMPLE_TIME
    tracked = law.beta_rate * z * (z - 1.0) / (z * z + (law.alpha + beta - 2.0) * z + 1.0 - law.alpha)
    velocity = tracked - law.band_share * _band_response(law.band, z)
    return velocity / _true(frequency, continuous_viscous.Parameters().lead_time)


def _band_response(law: band_pass.BandPass, z: FloatArray) -> FloatArray:
    return law.gain * (1.0 - z**-2) / (1.0 + law.a1 / z + law.a2 / z**2)


def _true(frequency: FloatArray, lead: float) -> FloatArray:
    return 2j * np.pi * frequency * np.exp(2j * math.pi * frequency * lead)


def draw_spectra(found: Found, idle: float, file: Path) -> Path:
    """Draw the chassis acceleration on the recorded road in bands of 1 Hz, without and with idle force."""
    figure = new_figure('The recorded drive as a road: acceleration of the chassis', 6.5)
    panels = figure.subplots(2, 1, sharex=True)
    for panel, force in zip(panels, (0.0, idle), strict=True):
        for who in COMPARED:
            spectrum = np.array(found['road', who, 'recorded', force]['spectrum'])
            middle = np.arange(spectrum.size) + 0.5
            panel.semilogy(middle, spectrum, color=_COLOURS[who], linestyle=_dash(who), label=who)
        panel.set_title(f'idle force {force:g} N', fontsize='medium')
        panel.set_ylabel('rms in 1 Hz (m/s$^2$)')
    panels[0].legend()
    panels[1].set_xlabel('frequency (Hz)')
    return finish(figure, file)


def draw_front(points: list[Values], file: Path) -> Path:
    """Draw the ratio on a light road over wear and over the acceleration with an idling engine."""
    figure = new_figure('What damping on light roads costs: lowest amplitude and damping varied')
    panels = figure.subplots(1, 2, sharey=True)
    labels = (
        ('j_per_km', 'energy in the pads (J/km)'),
        ('acceleration_idling', 'acceleration, engine idling, over no current'),
    )
    for panel, (what, label) in zip(panels, labels, strict=True):
        for point in points:
            colour = BLUE if point['on_front'] else GREY
            panel.plot(point[what], point['light_road'], 'o', color=colour, markersize=5)
            if point['name']:
                panel.annotate(
                    point['name'], (point[what], point['light_road']), xytext=(5, 5),
                    textcoords='offset points',
                )  # fmt: skip
        panel.set_xlabel(label)
    panels[0].set_ylabel('largest displacement, V0 = 0.04 m/s, over hydromount')
    return finish(figure, file)


def _dash(who: str) -> str:
    return {OFF: ':', HYDRO: '--'}.get(who, '-')


EXPERIMENT = Experiment(
    NAME,
    *NAMES[NAME],
    (
        "The paper's switched policy and the continuous law on the same roads, racks and engines, beside the "
        'hydromount and the mount without current: what each gives, and what it costs.'
    ),
    PolicyParameters(),
    run,
)
