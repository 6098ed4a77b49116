"""Pictures of a calibration: the force law over its points, and the gap curves over theirs (Figs 2 and 4)."""

from pathlib import Path

import matplotlib

matplotlib.use('Agg')

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from engine_mount.identification.actuator.points import gap_groups
from engine_mount.identification.coil.inductance import GapOrder, InductanceResult
from engine_mount.identification.rack.force_points import ForcePoints
from mount_models.actuator.law import ForceLaw, checked_force
from mount_models.coil.gap import evaluate

_BLUE, _RED, _GREY = '#1f5fa8', '#b03030', '#666666'
_DRAWN_GAPS = 7


def draw_force_law(points: ForcePoints, law: ForceLaw, file: Path) -> None:
    """Write the picture of points and law to `file` (PNG): force over current, and its error."""
    picture = Figure(figsize=(10.0, 7.0), layout='constrained')
    upper, lower = picture.subplots(2, 1, sharex=True, height_ratios=(3, 1))
    groups = gap_groups(points.gap)
    chosen = groups[:: max(1, len(groups) // _DRAWN_GAPS)]
    for number, group in enumerate(chosen):
        color = matplotlib.colormaps['viridis'](0.9 * number / max(1, len(chosen) - 1))
        gap = float(points.gap[group].mean())
        current = np.linspace(0.0, law.current_high, 200)
        upper.plot(points.current[group], points.force[group], '.', color=color, markersize=4)
        upper.plot(current, checked_force(law, current, gap), color=color, label=f'{gap * 1e6:.0f} µm')
    error = checked_force(law, points.current, points.gap) - points.force
    lower.plot(points.current, error, '.', color=_GREY, markersize=2)
    lower.axhline(0.0, color=_RED, linewidth=0.8)
    upper.set_ylabel('magnetic force (N)')
    lower.set_ylabel('law minus point (N)')
    lower.set_xlabel('coil current (A)')
    upper.legend(title='air gap', fontsize='small')
    _finish(upper, lower)
    picture.suptitle('Force law, Eqs (3) and (4): lines; measured: points')
    picture.savefig(file, dpi=100)


def draw_gap_curves(result: InductanceResult, order: GapOrder, file: Path) -> None:
    """Write the picture of map, curves and what temperature leaves to `file` (PNG)."""
    picture = Figure(figsize=(12.0, 8.0), layout='constrained')
    axes = picture.subplots(2, 2)
    _draw_map(axes[0, 0], result, order)
    _draw_temperatures(axes[0, 1], result)
    points = result.calibration.points
    gap = np.array([point.gap for point in points]) * 1e6
    for place, fit, values, label in (
        (axes[1, 0], result.calibration.inductance, [p.inductance * 1e3 for p in points], 'L at rest (mH)'),
        (
            axes[1, 1],
            result.calibration.crossing,
            [p.crossing_current for p in points],
            'crossing current (A)',
        ),
    ):
        dense = np.linspace(fit.polynomial.low, fit.polynomial.high, 200)
        factor = 1e3 if place is axes[1, 0] else 1.0
        place.plot(dense * 1e6, evaluate(fit.polynomial, dense) * factor, color=_BLUE, label='curve')
        place.plot(gap, values, '.', color=_RED, label='measured')
        place.set_title(f'degree {fit.degree}, rms {fit.gap_rms * 1e6:.2f} µm', fontsize='medium')
        place.set_xlabel('air gap (µm)')
        place.set_ylabel(label)
        place.legend(fontsize='small')
    _finish(*axes.flat)
    picture.suptitle('Gap from coil ripple (Fig. 4)')
    picture.savefig(file, dpi=100)


def _draw_map(place: Axes, result: InductanceResult, order: GapOrder) -> None:
    region = result.region
    chosen = range(0, region.gaps.size, max(1, region.gaps.size // _DRAWN_GAPS))
    for number, row in enumerate(chosen):
        color = matplotlib.colormaps['viridis'](0.9 * number / max(1, len(chosen) - 1))
        label = f'{region.gaps[row] * 1e6:.0f} µm'
        place.plot(region.currents, region.inductance[row] * 1e3, color=color, linewidth=1.0, label=label)
    for low, high in region.falling + region.rising:
        place.axvspan(low, high, color=_GREY, alpha=0.15, linewidth=0)
    place.axvline(order.rest_current, color=_RED, linestyle=':')
    place.axhline(order.crossing_inductance * 1e3, color=_RED, linestyle='--')
    place.set_title('shaded: the inductance tells the gap', fontsize='medium')
    place.set_xlabel('coil current (A)')
    place.set_ylabel('incremental inductance (mH)')
    place.legend(fontsize='small', title='air gap')


def _draw_temperatures(place: Axes, result: InductanceResult) -> None:
    names = {
        'rest_uncompensated_um': ('at rest, uncompensated', _BLUE, ':'),
        'rest_um': ('at rest', _BLUE, '-'),
        'contact_uncompensated_um': ('at contact, uncompensated', _RED, ':'),
        'contact_um': ('at contact', _RED, '-'),
    }
    rows = [row for row in result.left if row['source'] == 'predicted']
    known = [row for row in result.left if row['source'] != 'predicted']
    for name, (label, color, style) in names.items():
        place.plot(
            [row['celsius'] for row in rows], [row[name] for row in rows], style, color=color, label=label
        )
        place.plot(
            [row['celsius'] for row in known], [row[name] for row in known], 'o', color=color, markersize=4
        )
    place.set_title('lines: coefficient off by 20 %; dots: measured', fontsize='medium')
    place.set_xlabel('coil temperature (degC)')
    place.set_ylabel('largest gap error (µm)')
    place.legend(fontsize='small')


def _finish(*places: Axes) -> None:
    for place in places:
        place.grid(alpha=0.25)
