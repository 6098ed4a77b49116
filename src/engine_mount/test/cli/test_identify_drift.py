"""`engine-mount identify drift`: wear over recordings made with drifting contact gaps."""

import json

import numpy as np
import pytest

from engine_mount.drives.loop.recording import record_core
from engine_mount.identification.drift import fit_line

HOURS = (0.0, 50.0, 100.0, 150.0)
WEAR = 0.2e-6  # m/h


@pytest.fixture(scope='module')
def drives(tmp_path_factory):
    """Return recordings of drives whose contact gap falls by 0.2 um each hour, 1 % noise on the ripple."""
    folder = tmp_path_factory.mktemp('drives')
    for seed, hours in enumerate(HOURS):
        sim = {
            'scenario': 'bench', 'timeline.start': 2.8, 'timeline.duration': 0.2, 'seed': seed,
            'electronics.ripple_noise': 0.01, 'mechanics.contact_gap': 349e-6 - WEAR * hours,
        }  # fmt: skip
        record_core(folder / f'{hours:g}h', {'mount_sim': sim}, '')
    return [folder / f'{hours:g}h' for hours in HOURS]


def hours_of(drives, hours=HOURS):
    return [word for path, h in zip(drives, hours, strict=True) for word in ('--hours', f'{path}={h}')]


def test_the_wear_comes_back_within_its_uncertainty(drives, tmp_path, command):
    targets = ('--json', tmp_path / 'd.json', '--figure', tmp_path / 'd.png')
    command('identify', 'drift', *drives, *hours_of(drives), *targets)
    found = json.loads((tmp_path / 'd.json').read_text())
    wear, std = found['contact_gap']['per_hour_m'], found['contact_gap']['per_hour_std_m']
    assert wear == pytest.approx(-WEAR, abs=3.0 * std)
    assert wear == pytest.approx(-WEAR, rel=0.1)
    left = found['remaining_travel_m']
    assert found['least_contact_gap_m'] == pytest.approx(270e-6 + 300.0 / 2e7, abs=2e-6)
    assert left == pytest.approx(349e-6 - WEAR * 150.0 - found['least_contact_gap_m'], abs=2e-6)
    assert found['remaining_hours'] == pytest.approx(left / -wear)
    first, *_, last = (each['offset_current_a'] for each in found['recordings'])
    assert found['offset_current']['per_hour_a'] == pytest.approx((last - first) / 150.0, rel=0.1)
    assert (tmp_path / 'd.png').stat().st_size > 10_000


@pytest.mark.parametrize(
    ('count', 'hours', 'sentence'),
    [
        (1, HOURS[:1], '1 recording shows no drift; at least 2'),
        (3, (5.0, 5.0, 5.0), 'all 3 recordings are from one time'),
        (2, None, 'holds no time at which it began'),
        (2, (3.0,), 'for all recordings or none'),
    ],
)
def test_what_shows_no_drift_is_refused(drives, count, hours, sentence, tmp_path, refused):
    told = [] if hours is None else hours_of(drives[: len(hours)], hours)
    assert sentence in refused('identify', 'drift', *drives[:count], *told, '--json', tmp_path / 'd.json')
    assert not (tmp_path / 'd.json').exists()


def test_the_stated_deviation_of_the_slope_is_the_scatter_of_repeated_slopes():
    random = np.random.default_rng(0)
    hours, stds = np.array([0.0, 1.0, 2.0, 5.0, 9.0]), np.array([1.0, 2.0, 1.0, 3.0, 1.0])
    fits = [fit_line(hours, 3.0 - 0.5 * hours + stds * random.standard_normal(5), stds) for _ in range(400)]
    slopes = np.array([fit.slope for fit in fits])
    assert slopes.mean() == pytest.approx(-0.5, abs=0.03)
    exact = fit_line(hours, 3.0 - 0.5 * hours, stds)
    assert exact.ratio == 1.0
    assert slopes.std() == pytest.approx(exact.slope_std, rel=0.1)


def test_values_that_scatter_more_than_stated_are_less_sure():
    hours = np.arange(6.0)
    values = np.array([0.0, 1.0, -1.0, 1.0, -1.0, 0.0])
    stated, wide = (fit_line(hours, values, np.full(6, std)) for std in (0.01, 10.0))
    assert stated.slope_std == pytest.approx(fit_line(hours, values).slope_std)
    assert wide.slope_std == pytest.approx(10.0 / np.sqrt(17.5))
