"""`engine-mount identify drift`: wear over recordings made with drifting contact gaps."""

import json

import numpy as np
import pytest

from engine_mount.cli.command import main
from engine_mount.drives.loop.run import run_core
from engine_mount.identification.drift.law import DriftError, fitted_drift
from mount_recorder.bag_writer import BagWriter
from mount_ros.messages.cdr import wrench
from mount_ros.messages.force_table import table_message
from mount_ros.messages.scalars import OneNumberLayout, ScalarsLayout
from mount_ros.topics import (
    AIR_GAP,
    CURRENT_FORCE_TABLE,
    DISPLACEMENT,
    SIM_CLAMP_FORCE,
    SIM_MOUNT_FORCE,
    TOPICS,
)

HOURS = (0.0, 50.0, 100.0, 150.0)
WEAR = 0.2e-6  # m/h
RACK_HOURS = (0.0, 30.0, 60.0, 90.0, 120.0, 150.0)
GAP_STD = 1e-6  # m
COEFFICIENT, FADING, SCATTER = 0.8, -4e-4, 4e-3  # at 0 h; per h; of single recordings


@pytest.fixture(scope='module')
def drives(tmp_path_factory):
    """Return recordings of drives whose contact gap falls by 0.2 um each hour, 1 % noise on the ripple."""
    folder = tmp_path_factory.mktemp('drives')
    made = []
    for seed, hours in enumerate(HOURS):
        writer = BagWriter(folder / f'{hours:g}h')
        for topic in TOPICS:
            if topic.name in (AIR_GAP.name, CURRENT_FORCE_TABLE.name):
                writer.add_topic(f'/{topic.name}', topic.type, latched=True)
        sim = {
            'scenario': 'bench', 'timeline.start': 2.8, 'timeline.duration': 0.2, 'seed': seed,
            'electronics.ripple_noise': 0.01, 'mechanics.contact_gap': 349e-6 - WEAR * hours,
        }  # fmt: skip

        def write(topic, raw, stamp, writer=writer):
            if topic.name in (AIR_GAP.name, CURRENT_FORCE_TABLE.name):
                writer.write(f'/{topic.name}', raw, stamp)

        run_core({'mount_sim': sim}, write)
        writer.close()
        made.append(folder / f'{hours:g}h')
    return made


@pytest.fixture(scope='module')
def on_rack(tmp_path_factory):
    """Return recordings with the load cells of a rack, and their coefficients of friction: wear is known."""
    random = np.random.default_rng(8)
    folder = tmp_path_factory.mktemp('on_rack')
    made, coefficients = [], []
    for number, hours in enumerate(RACK_HOURS):
        coefficient = COEFFICIENT + FADING * hours + SCATTER * random.standard_normal()
        gap = 349e-6 - WEAR * hours + GAP_STD * random.standard_normal()
        rest = random.standard_normal((3, 1200))
        made.append(record_on_rack(folder / f'rack{hours:g}h', coefficient, gap, 60.0 + 8.0 * number, rest))
        coefficients.append(coefficient)
    return made, coefficients


def record_on_rack(folder, coefficient, gap, clamp, noise):
    """Record strokes of 1 mm at 10 mm/s, each followed by as long a rest with a fifth of the friction."""
    samples = np.arange(noise.shape[1])
    sliding, side = samples % 200 < 100, np.where(samples // 200 % 2 == 0, 1.0, -1.0)
    displacement = np.cumsum(1e-5 * side * sliding) + 2e-8 * noise[0]
    normal = clamp * (1.0 + 0.01 * noise[1])
    force = side * coefficient * clamp * (np.where(sliding, 1.0, 0.2) + 0.01 * noise[2])
    topics = (AIR_GAP, CURRENT_FORCE_TABLE, DISPLACEMENT, SIM_MOUNT_FORCE, SIM_CLAMP_FORCE)
    writer = BagWriter(folder)
    for topic in topics:
        writer.add_topic(f'/{topic.name}', topic.type, latched=topic in topics[:2])
    found = {'rest_gap': 500e-6, 'contact_gap': gap, 'contact_gap_std': GAP_STD, 'offset_current': 0.49}
    gaps, positions = ScalarsLayout(AIR_GAP), ScalarsLayout(DISPLACEMENT)
    forces = OneNumberLayout(wrench)
    table = np.array([[0.5, 3.0], [0.0, 300.0]])
    writer.write(f'/{AIR_GAP.name}', gaps.pack(0, [found.get(name, 1.0) for name in gaps.names]), 0)
    writer.write(f'/{CURRENT_FORCE_TABLE.name}', table_message(0, table), 0)
    rows = zip(displacement.tolist(), force.tolist(), normal.tolist(), strict=True)
    for sample, (x, friction, load) in enumerate(rows):
        stamp = 1_000_000 * sample
        writer.write(f'/{DISPLACEMENT.name}', positions.pack(stamp, (x,)), stamp)
        writer.write(f'/{SIM_MOUNT_FORCE.name}', forces.pack(stamp, friction), stamp)
        writer.write(f'/{SIM_CLAMP_FORCE.name}', forces.pack(stamp, load), stamp)
    writer.close()
    return folder


def drift(*words):
    with pytest.raises(SystemExit) as ended:
        main(['identify', 'drift', *map(str, words)])
    return ended.value.code


def hours_of(drives, hours=HOURS):
    return [word for path, h in zip(drives, hours, strict=True) for word in ('--hours', f'{path}={h}')]


def test_the_wear_comes_back_within_its_uncertainty(drives, tmp_path):
    assert (
        drift(*drives, *hours_of(drives), '--json', tmp_path / 'd.json', '--figure', tmp_path / 'd.png') == 0
    )
    found = json.loads((tmp_path / 'd.json').read_text())
    wear, std = found['contact_gap']['per_hour_m'], found['contact_gap']['per_hour_std_m']
    assert wear == pytest.approx(-WEAR, abs=3.0 * std)
    assert wear == pytest.approx(-WEAR, rel=0.1)
    left = found['remaining_travel_m']
    assert found['least_contact_gap_m'] == pytest.approx(270e-6 + 300.0 / 2e7, abs=2e-6)
    assert left == pytest.approx(349e-6 - WEAR * 150.0 - found['least_contact_gap_m'], abs=2e-6)
    assert found['remaining_hours'] == pytest.approx(left / -wear)
    assert found['friction'] is None
    first, *_, last = (each['offset_current_a'] for each in found['recordings'])
    assert found['offset_current']['per_hour_a'] == pytest.approx((last - first) / 150.0, rel=0.1)
    assert (tmp_path / 'd.png').stat().st_size > 10_000


def test_friction_of_recordings_on_a_rack_comes_back_with_its_uncertainty(on_rack, tmp_path, capsys):
    recordings, coefficients = on_rack
    told = hours_of(recordings, RACK_HOURS)
    assert drift(*recordings, *told, '--json', tmp_path / 'd.json', '--figure', tmp_path / 'd.png') == 0
    assert 'friction: -0.000' in capsys.readouterr().out
    found = json.loads((tmp_path / 'd.json').read_text())
    assert [each['friction'] for each in found['recordings']] == pytest.approx(coefficients, rel=2e-3)
    line = found['friction']
    assert line['per_hour_1'] == pytest.approx(FADING, abs=3.0 * line['per_hour_std_1'])
    (slope, _), covariance = np.polyfit(RACK_HOURS, coefficients, 1, cov=True)
    assert line['per_hour_1'] == pytest.approx(slope, abs=0.1 * line['per_hour_std_1'])
    assert line['per_hour_std_1'] == pytest.approx(np.sqrt(covariance[0, 0]), rel=0.1)
    assert line['mean_1'] == pytest.approx(np.mean(coefficients), rel=1e-3)
    gap = found['contact_gap']
    assert gap['per_hour_m'] == pytest.approx(-WEAR, abs=3.0 * gap['per_hour_std_m'])
    stated = GAP_STD / np.sqrt(np.sum((np.array(RACK_HOURS) - np.mean(RACK_HOURS)) ** 2))
    assert gap['per_hour_std_m'] == pytest.approx(stated * gap['scatter_over_stated'], rel=1e-9)


def test_recordings_without_load_cells_leave_friction_to_the_others(drives, on_rack, tmp_path):
    racks = on_rack[0][:1]
    for others, known in ((drives[1:2], False), ([drives[1], on_rack[0][5]], True)):
        recordings = [*racks, *others]
        hours = (0.0, 50.0, 150.0)[: len(recordings)]
        assert drift(*recordings, *hours_of(recordings, hours), '--json', tmp_path / 'd.json') == 0
        found = json.loads((tmp_path / 'd.json').read_text())
        assert [each['friction'] is None for each in found['recordings']] == [False, True, False][
            : len(hours)
        ]
        assert (found['friction'] is not None) is known


@pytest.mark.parametrize(
    ('count', 'hours', 'sentence'),
    [
        (1, HOURS[:1], '1 recording tells no drift; at least 2'),
        (3, (5.0, 5.0, 5.0), 'all 3 recordings are from one time'),
        (2, None, 'does not tell when it began'),
    ],
)
def test_what_tells_no_drift_is_refused(drives, count, hours, sentence, tmp_path, capsys):
    told = [] if hours is None else hours_of(drives[:count], hours)
    assert drift(*drives[:count], *told, '--json', tmp_path / 'd.json') == 1
    assert sentence in capsys.readouterr().err.replace('\n', ' ')
    assert not (tmp_path / 'd.json').exists()


def test_hours_of_some_recordings_only_are_refused(drives, capsys):
    assert drift(*drives[:2], '--hours', f'{drives[0]}=3') == 1
    assert 'for all recordings or none' in capsys.readouterr().err


def test_the_stated_deviation_of_the_slope_is_the_scatter_of_repeated_slopes():
    random = np.random.default_rng(0)
    hours, stds = np.array([0.0, 1.0, 2.0, 5.0, 9.0]), np.array([1.0, 2.0, 1.0, 3.0, 1.0])
    fits = [
        fitted_drift(hours, 3.0 - 0.5 * hours + stds * random.standard_normal(5), stds) for _ in range(400)
    ]
    slopes = np.array([fit.slope for fit in fits])
    assert slopes.mean() == pytest.approx(-0.5, abs=0.03)
    exact = fitted_drift(hours, 3.0 - 0.5 * hours, stds)
    assert exact.ratio == 1.0
    assert slopes.std() == pytest.approx(exact.slope_std, rel=0.1)


def test_values_that_scatter_more_than_stated_are_less_sure():
    hours = np.arange(6.0)
    values = np.array([0.0, 1.0, -1.0, 1.0, -1.0, 0.0])
    stated, wide = (fitted_drift(hours, values, np.full(6, std)) for std in (0.01, 10.0))
    assert stated.slope_std == pytest.approx(fitted_drift(hours, values).slope_std)
    assert wide.slope_std == pytest.approx(10.0 / np.sqrt(17.5))


def test_without_stated_deviations_the_scatter_of_the_values_tells_that_of_the_slope():
    random = np.random.default_rng(1)
    hours = np.array(RACK_HOURS)
    fits = [fitted_drift(hours, 0.8 - 4e-4 * hours + 4e-3 * random.standard_normal(6)) for _ in range(400)]
    slopes, stated = np.array([(fit.slope, fit.slope_std) for fit in fits]).T
    assert slopes.mean() == pytest.approx(-4e-4, abs=5e-6)
    assert np.sqrt(np.mean(stated**2)) == pytest.approx(slopes.std(), rel=0.1)


def test_a_deviation_of_zero_is_refused():
    with pytest.raises(DriftError, match='must be above 0'):
        fitted_drift([0.0, 1.0], [1.0, 2.0], [0.1, 0.0])
