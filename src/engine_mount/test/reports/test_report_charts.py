"""What a report computes, against signals whose answer is known, and how its charts become drawings."""

import base64
import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from engine_mount.reports.drawing.chart import Chart, ChartError, Curve, Level, Panel, Span
from engine_mount.reports.drawing.detail import browser_chart, budget_of, even_numbers
from engine_mount.reports.drawing.envelope import envelope
from engine_mount.reports.drawing.page import page
from engine_mount.reports.drawing.picture import draw_chart
from engine_mount.reports.sections import charts
from engine_mount.reports.sections.charts import Levels, Named
from engine_mount.reports.sections.coil_load import coil_load
from engine_mount.reports.sections.periodic import (
    cycle_work,
    distortion,
    dominant_sine,
    harmonics,
    whole_periods,
)
from engine_mount.reports.sections.section import Section
from engine_mount.reports.sections.spectrum import amplitude_density, evenly
from engine_mount.reports.sections.sweep import find_sweep, peak_per_band, rms_per_band

TIME = np.arange(4000) * 1e-3


def test_the_frequency_between_two_lines_of_the_spectrum_is_found():
    sine = dominant_sine(TIME, 0.3 + 2.0 * np.sin(2 * np.pi * 8.137 * TIME + 1.0))
    assert sine.frequency == pytest.approx(8.137, abs=1e-5)
    assert sine.amplitude == pytest.approx(2.0, rel=1e-6)
    assert sine.share == pytest.approx(1.0, abs=1e-9)


def test_a_sine_of_which_less_than_two_periods_were_recorded_is_found_too():
    sine = dominant_sine(TIME, 0.3 + 2.0 * np.sin(2 * np.pi * 0.2 * TIME + 1.0))
    assert sine.frequency == pytest.approx(0.2, rel=1e-3)
    assert sine.amplitude == pytest.approx(2.0, rel=1e-2)


def test_noise_is_no_sine():
    assert dominant_sine(TIME, np.random.default_rng(1).normal(size=len(TIME))).share < 0.1


@pytest.mark.parametrize('values', [np.zeros(100), np.full(100, np.nan), np.arange(3.0)])
def test_what_does_not_move_has_no_frequency(values):
    assert np.isnan(dominant_sine(np.arange(len(values)) * 1e-3, values).frequency)


def test_harmonics_are_told_apart_also_where_no_whole_periods_were_recorded():
    amplitudes = (209.5, 0.3, 3.75, 0.02, 2.03, 0.01, 1.4, 0.01)
    force = sum(
        a * np.sin(2 * np.pi * 8.3 * number * TIME + number) for number, a in enumerate(amplitudes, 1)
    )
    assert harmonics(TIME, force, 8.3) == pytest.approx(amplitudes, abs=1e-6)
    assert distortion(harmonics(TIME, force, 8.3)) == pytest.approx(0.0215, abs=1e-4)


def test_harmonics_need_two_periods():
    with pytest.raises(ValueError, match='need two periods'):
        harmonics(TIME[:200], TIME[:200], 8.0)


def test_a_damper_s_work_per_cycle_is_pi_c_omega_a_squared():
    omega, amplitude, damping, stiffness = 2 * np.pi * 8.0, 1e-3, 2000.0, 1.6e5
    inside, periods = whole_periods(TIME, 8.0, 32)
    x, v = amplitude * np.sin(omega * TIME), amplitude * omega * np.cos(omega * TIME)
    work = cycle_work(x[inside], (stiffness * x + damping * v)[inside], periods)
    assert periods == 31
    assert work == pytest.approx(np.pi * damping * omega * amplitude**2, rel=1e-3)


def test_a_spectrum_holds_the_variance_where_it_is():
    values = np.sqrt(2.0) * 3.0 * np.sin(2 * np.pi * 20.0 * np.arange(20_000) * 1e-3)
    frequency, density = amplitude_density(values, 1000.0)
    power = density**2 * (frequency[1] - frequency[0])
    assert np.sum(power[np.abs(frequency - 20.0) < 2.0]) == pytest.approx(9.0, rel=2e-3)
    assert np.sum(power[(frequency >= 30.0) & (frequency < 100.0)]) < 1e-6


def test_missing_and_unknown_samples_are_bridged_and_counted():
    values = TIME.copy()
    values[100:110] = np.nan
    kept = np.delete(np.arange(len(TIME)), [500, 501])
    grid, bridged, made_up = evenly(TIME[kept], values[kept], 1000.0)
    assert made_up == 12
    assert grid == pytest.approx(TIME)
    assert bridged == pytest.approx(TIME)


def chirp(first: float, rate: float, seconds: float) -> tuple[np.ndarray, np.ndarray]:
    time = np.arange(round(seconds * 1000)) * 1e-3
    return time, np.sin(2 * np.pi * (first * time + 0.5 * rate * time**2))


def test_a_sweep_is_recognised_with_its_frequency_at_each_time():
    time, values = chirp(1.0, 1.0, 30.0)
    sweep = find_sweep(time, values)
    assert sweep is not None
    assert sweep.at(np.array([5.0, 20.0])) == pytest.approx([6.0, 21.0], abs=0.05)
    assert np.isnan(sweep.at(np.array([31.0])))[0]


@pytest.mark.parametrize('kind', ['sine', 'noise', 'rest', 'falling', 'two sines'])
def test_what_is_no_sweep_is_not_taken_for_one(kind):
    values = {
        'sine': np.sin(2 * np.pi * 8.0 * TIME),
        'noise': np.random.default_rng(2).normal(size=len(TIME)),
        'rest': np.zeros(len(TIME)),
        'falling': chirp(1.0, 5.0, 4.0)[1][::-1],
        'two sines': np.sin(2 * np.pi * np.where(TIME < 2.0, 8.0, 40.0) * (TIME - 2.0)),
    }[kind]
    assert find_sweep(TIME, values) is None


def test_each_band_of_a_sweep_has_its_own_peak_and_rms():
    frequency = np.array([1.0, 1.5, 1.999, 2.0, 2.5, 5.2, np.nan])
    values = np.array([1.0, -3.0, 2.0, 4.0, np.nan, -5.0, 100.0])
    edges, peaks = peak_per_band(frequency, values)
    assert edges.tolist() == [1.0, 2.0, 5.0]
    assert peaks.tolist() == [3.0, 4.0, 5.0]
    assert rms_per_band(frequency, values)[1] == pytest.approx([np.sqrt(14 / 3), 4.0, 5.0])


def test_the_heat_of_a_coil_is_that_of_the_rms_current():
    current = np.where(TIME < 1.0, 3.0, 1.0)
    load = coil_load(TIME, current, 2.5, 3.0)
    assert load.rms_current == pytest.approx(np.sqrt(3.0))
    assert load.mean_heat == pytest.approx(7.5)
    assert load.energy == pytest.approx(30.0)
    assert load.share_at_limit == pytest.approx(0.25)


def test_unknown_current_is_neither_load_nor_time():
    load = coil_load(TIME, np.where(TIME < 2.0, 2.0, np.nan), 1.0, None)
    assert load.duration == pytest.approx(2.0)
    assert load.rms_current == pytest.approx(2.0)
    assert np.isnan(load.share_at_limit)
    assert np.isnan(coil_load(TIME, np.full(len(TIME), np.nan), 1.0, 3.0).rms_current)


@settings(deadline=None, max_examples=60)
@given(st.integers(0, 10_000), st.integers(4, 300), st.integers(0, 2**31))
def test_an_envelope_is_short_and_hides_no_extreme(count, points, seed):
    rng = np.random.default_rng(seed)
    x, y = np.arange(float(count)), rng.normal(size=count)
    y[rng.random(count) < 0.02] = np.nan
    shown_x, shown_y = envelope(x, y, points)
    assert len(shown_x) <= points
    assert set(shown_x) <= set(x)
    if np.isfinite(y).any():
        assert np.nanmax(shown_y) == np.nanmax(y)
        assert np.nanmin(shown_y) == np.nanmin(y)


def test_a_long_gap_stays_a_gap_in_the_envelope():
    y = np.ones(10_000)
    y[4000:6000] = np.nan
    x, shown = envelope(np.arange(10_000.0), y, 100)
    inside = shown[(x > 4200) & (x < 5800)]
    assert len(inside) > 0
    assert np.isnan(inside).all()


HARMONICS = np.arange(1.0, 9.0)
LEVELS = {'switch-on level': 8e-4, 'switch-off level': 3.5e-4}


def all_charts() -> list[Chart]:
    two = [Named('A', TIME, np.sin(TIME)), Named('B <b>', TIME, np.cos(TIME))]
    levels = Levels(LEVELS, 3.0)
    return [
        charts.time_traces(two, two, levels, [(0.5, 1.0)]),
        charts.hysteresis_loops(two, two[:1]),
        charts.harmonics_dots([Named('', HARMONICS, np.ones(8)), Named('B', HARMONICS, np.ones(8))]),
        charts.spectra([('displacement (mm/√Hz)', two)]),
        charts.sweep_bands([Named('', np.arange(3.0), np.ones(3))], [Named('', np.arange(3.0), np.ones(3))]),
        charts.tracking(two[:1], two[1:], [(0.5, 1.0)], (0.4, 1.1)),
        charts.plain_traces([('x', two)]),
    ]


@pytest.mark.parametrize('chart', all_charts(), ids=lambda chart: chart.name)
def test_every_axis_has_a_label_with_its_unit(chart):
    told = json.loads(json.dumps(browser_chart(chart), allow_nan=False))
    labels = [told['x_label'], *(panel['label'] for panel in told['panels'])]
    assert len(labels) == 1 + len(chart.panels)
    assert all(label.endswith(')') or label in ('harmonic', 'x') for label in labels)


def read_back(even: dict) -> tuple[np.ndarray, np.ndarray]:
    """Return the lowest and the highest values as the page's script decodes them."""
    raw = np.frombuffer(base64.b64decode(even['values']), '<i2').astype(float)
    values = np.where(raw == -32768, np.nan, even['low'] + even['size'] * (raw + 32767))
    pairs = values.reshape(-1, 2) if even['pairs'] else np.stack([values, values], 1)
    return pairs[:, 0], pairs[:, 1]


@settings(deadline=None, max_examples=60)
@given(st.integers(3001, 20_000), st.integers(3000, 30_000), st.booleans(), st.integers(0, 2**31))
def test_a_long_curve_is_told_briefly_and_hides_no_extreme(count, budget, jitter, seed):
    rng = np.random.default_rng(seed)
    kept = np.flatnonzero(rng.random(count) > 0.01)
    x, y = kept * 1e-3, rng.normal(size=len(kept))
    if jitter:
        x = x + rng.uniform(-3e-4, 3e-4, len(kept))
    y[rng.random(len(kept)) < 0.02] = np.nan
    even = even_numbers(x, y, budget)
    low, high = read_back(even)
    assert len(low) * (2 if even['pairs'] else 1) <= budget + 2
    assert even['begin'] + even['step'] * len(low) >= x[-1] - 1e-9
    assert np.nanmax(high) == pytest.approx(np.nanmax(y), abs=2 * even['size'])
    assert np.nanmin(low) == pytest.approx(np.nanmin(y), abs=2 * even['size'])
    if not even['pairs']:
        places = np.round((x - x[0]) / even['step']).astype(int)
        np.testing.assert_allclose(low[places], y, atol=even['size'])
        assert np.isnan(np.delete(low, places)).all()
    known = np.isfinite(y)
    group = ((x - x[0]) / even['step'] + (1e-9 if even['pairs'] else 0.5)).astype(int)
    assert (low[group[known]] <= y[known] + even['size']).all()
    assert (high[group[known]] >= y[known] - even['size']).all()


def test_what_short_curves_leave_goes_to_the_long_ones():
    def chart(length: int) -> Chart:
        x = np.arange(float(length))
        return Chart('c', 'c', 'x (s)', [Panel('y (N)', [Curve('y', x, x)])])

    assert budget_of([chart(10)], 100_000) == 100_000
    assert budget_of([chart(10_000), chart(200_000), chart(300_000)], 100_000) == 45_000
    assert budget_of([chart(30_000), chart(30_000)], 100_000) >= 30_000


def test_displacements_are_drawn_in_mm_with_the_levels_of_the_policy():
    chart = charts.time_traces([Named('', TIME, np.full(len(TIME), 1e-3))], [], Levels(LEVELS))
    (panel,) = chart.panels
    assert panel.curves[0].y[0] == pytest.approx(1.0)
    assert [(level.value, level.both) for level in panel.levels] == [
        (pytest.approx(0.8), True),
        (pytest.approx(0.35), True),
    ]


def test_harmonics_are_dots_in_decibels_and_none_is_no_dot():
    (panel,) = charts.harmonics_dots([Named('', HARMONICS[:3], np.array([100.0, 1.0, 0.0]))]).panels
    assert panel.dots[0].y[:2].tolist() == [40.0, 0.0]
    assert np.isnan(panel.dots[0].y[2])


def test_what_differs_between_two_recordings_stands_below_them():
    two = [Named('A', TIME, np.zeros(len(TIME))), Named('B', TIME + 5e-4, np.full(len(TIME), 1e-3))]
    chart = charts.time_traces(two, two, Levels(), differ=True)
    assert [panel.label for panel in chart.panels][1::2] == ['displacement, B - A (mm)', 'current, B - A (A)']
    (curve,) = chart.panels[1].curves
    assert curve.y[:-1] == pytest.approx(1.0)
    assert np.isnan(curve.y[-1])  # behind the end of A


@pytest.mark.parametrize('chart', all_charts()[:3], ids=lambda chart: chart.name)
def test_a_picture_is_1000_pixels_wide(chart, tmp_path):
    draw_chart(chart, tmp_path / 'x.png')
    raw = (tmp_path / 'x.png').read_bytes()
    assert raw.startswith(b'\x89PNG')
    assert int.from_bytes(raw[16:20], 'big') == 1000


def test_what_does_not_fit_together_is_refused():
    with pytest.raises(ChartError, match='3 x but 2 y'):
        Curve('y', np.arange(3.0), np.arange(2.0))
    with pytest.raises(ChartError, match='no panel'):
        Chart('c', 'c', 'x', [], [Span(0.0, 1.0)])
    assert Level('l', 1.0).both is False


def test_no_text_in_a_chart_ends_the_script_that_holds_it():
    chart = Chart('c', 'c', '</script>', [Panel('y (N)', [Curve('y', TIME, TIME)])])
    text = page('t', [Section('c', 'C', chart=chart)])
    block = text.split('<script type="application/json">')[1].split('</script>')[0]
    assert json.loads(block)['x_label'] == '</script>'
