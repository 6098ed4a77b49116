"""How charts become drawings: in a picture, and in the numbers that a page holds."""

import base64
import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib import image

from engine_mount.reports.drawing.chart import POINTS, SHADING, Chart, Curve, Level, Panel
from engine_mount.reports.drawing.detail import NUMBERS, browser_chart, budget_of, even_numbers
from engine_mount.reports.drawing.page import page
from engine_mount.reports.drawing.picture import draw_chart
from engine_mount.reports.sections.section import Section


def chart_of(*lengths: int) -> Chart:
    curves = [Curve('y', np.arange(float(length)), np.arange(float(length))) for length in lengths]
    return Chart('c', '</title>', '</script>', [Panel('y (N)', curves)])


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


def test_the_numbers_of_a_page_are_shared_by_its_long_curves():
    assert budget_of([chart_of(10)]) == NUMBERS
    assert budget_of([chart_of(10), chart_of(200_000, 300_000)]) == NUMBERS // 2


def test_a_picture_shows_the_first_view_the_whole_below_and_a_shade_by_its_degree(tmp_path):
    x = np.arange(20_000.0)
    y = np.where(x == 7777.0, 50.0, np.sin(x))
    dots = Curve('largest', x[:1], y[:1], dash=POINTS)
    panel = Panel('y (N)', [Curve('y', x, y), Curve('z', x, y), dots], [Level('on', 40.0)])
    shade = Curve('degree', x, np.where(x < 10_000.0, 0.5, 1.0), '#000000')
    chart = Chart('c', 'c', 'x (s)', [panel, Panel('z (N)', [Curve('z', x, y)])], shade, (0.0, 20_000.0))
    heights = []
    for view in (None, (9_000.0, 11_000.0)):
        draw_chart(replace(chart, view=view), tmp_path / 'x.png')
        picture = image.imread(tmp_path / 'x.png')
        assert picture.shape[1] == 1000
        heights.append(len(picture))
        row = picture[300, :, 0]  # of the first panel, above its curves
        for degree in (0.5, 1.0):
            assert np.count_nonzero(np.abs(row - (1.0 - degree * SHADING)) < 0.01) > 300
    assert heights[1] > heights[0]
    assert browser_chart(chart)['shade']['name'] == 'degree'


def test_no_text_in_a_chart_ends_the_script_that_holds_it():
    text = page('t', [Section('c', 'C', chart=chart_of(10))])
    block = text.split('<script type="application/json">')[1].split('</script>')[0]
    assert json.loads(block)['x_label'] == '</script>'
