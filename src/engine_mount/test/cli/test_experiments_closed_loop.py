"""Rack, sweep and gap on short versions, and the values that the laws lead to."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from engine_mount.experiments import bench, motorway_gap, policy_cases, sweep
from engine_mount.experiments.harness.closed_loop import Case, run_case
from engine_mount.experiments.harness.experiment import Holds
from engine_mount.experiments.registry import experiment
from engine_mount.experiments.sweep import defined_peak
from engine_mount.recordings.recording import open_recording
from mount_models.damper import damper_curve

pytestmark = pytest.mark.slow

PNG = b'\x89PNG'


def check(outcome):
    json.dumps(outcome.figures, allow_nan=False)
    assert outcome.pictures
    assert all(picture.read_bytes().startswith(PNG) for picture in outcome.pictures)
    assert all('sim/truth' in open_recording(place) for place in outcome.recordings)
    assert outcome.claims


@pytest.fixture(scope='module')
def rack(tmp_path_factory):
    return experiment(bench.NAME, out=tmp_path_factory.mktemp('rack'))


@pytest.fixture(scope='module')
def swept(tmp_path_factory):
    return experiment(sweep.NAME, out=tmp_path_factory.mktemp('sweep'), last_frequency=14.5)


@pytest.fixture(scope='module')
def gaps(tmp_path_factory):
    return experiment(motorway_gap.NAME, out=tmp_path_factory.mktemp('gap'), duration=2.5, gap_time=0.5)


# Rack.


def test_the_rack_writes_recordings_pictures_and_plain_figures(rack):
    check(rack)
    assert len(rack.recordings) == 6
    assert len(rack.figures['runs'][rack.figures['damper']]['harmonics_n']) == 8
    runs = rack.figures['runs']
    assert {1, 3, 5, 7} <= set(runs['viscous_3000']['lower_than_hydromount'])
    assert 7 not in runs['viscous_4000']['lower_than_hydromount']
    assert runs['viscous_2000']['thd'] <= 0.5 * runs[bench.HYDRO]['thd']


@pytest.mark.parametrize(
    ('damper', 'first', 'loss_stiffness'), [('viscous_1000', 190.8, 59e3), ('viscous_4000', 268.7, 198e3)]
)
def test_each_characteristic_gives_its_first_harmonic_and_loss(rack, damper, first, loss_stiffness):
    found = rack.figures['runs'][damper]
    assert found['harmonics_n'][0] == pytest.approx(first, rel=0.03)
    assert found['loss_stiffness_n_per_m'] == pytest.approx(loss_stiffness, rel=0.03)


def test_the_page_on_differences_tells_the_harmonics_of_the_law_and_of_this_rack(rack):
    page = Path(__file__).parents[4] / 'docs' / 'explanation' / 'differences.md'
    rows = re.findall(r'^\| (\d000) \| ([357]) \| ([\d.]+) \| ([\d.]+) \|', page.read_text(), re.MULTILINE)
    assert len(rows) == 12
    velocity = 2 * np.pi * 8e-3 * np.cos(2 * np.pi * np.arange(20000) / 20000)
    for damping, order, told_law, told_here in rows:
        law = damper_curve(f'viscous_{damping}').force(velocity)
        exact = np.abs(np.fft.rfft(law))[int(order)] / 10000
        assert float(told_law) == pytest.approx(exact, abs=0.001)
        here = rack.figures['runs'][f'viscous_{damping}']['friction_harmonics_n'][int(order) - 1]
        assert float(told_here) == pytest.approx(here, abs=0.01)
        # the light pressure fills the dead zone a little, the fitted force law bends the rest
        assert here == pytest.approx(exact, rel=0.1)


@pytest.mark.parametrize('mount', ['friction', 'hydro'])
def test_half_the_step_of_the_plant_changes_no_odd_harmonic_by_half_a_percent(mount, monkeypatch):
    quiet_bench = {
        'scenario': 'bench',
        'mount': mount,
        'timeline.start': 2.9,
        'timeline.duration': 4.0,
        'bench.frequency': 8.0,
        'electronics.displacement_noise': 0.0,
        'electronics.ripple_noise': 0.0,
    }
    paper = {'policy': 'switched_viscous'}
    case = Case({'mount_sim': quiet_bench, 'mount_control': paper}, policy_cases.of_rack)
    found = []
    for step in (5e-5, 2.5e-5):
        monkeypatch.setattr('mount_sim.excitation.building.STEP_TIME', step)
        found.append(np.array(run_case(case)['harmonics_n'])[[0, 2, 4, 6]])
    assert not np.array_equal(*found)
    assert found[1] == pytest.approx(found[0], rel=0.005)


# Sweep.


def test_the_sweep_names_its_bands(swept):
    check(swept)
    chosen = swept.figures['runs'][sweep.FRICTION]
    assert chosen['bands_hz'] == [k + 0.5 for k in range(1, 15)]
    assert len(chosen['peak_displacement_m']) == 14


@pytest.mark.parametrize(
    ('name', 'peaks_mm'),
    [
        (sweep.HYDRO, (0.37, 0.43, 0.47, 0.55, 0.72, 1.03, 1.32, 1.29, 0.50, 0.31, 0.21)),
        # damping has not come on yet, or is off again
        (sweep.FRICTION, (0.38, 0.46, 0.66, 0.95)),
    ],
)
def test_peaks_over_frequency_are_those_of_the_laws(swept, name, peaks_mm):
    found = 1e3 * np.array(swept.figures['runs'][name]['peak_displacement_m'])
    assert found[2 : 2 + len(peaks_mm)] == pytest.approx(peaks_mm, rel=0.03, abs=0.006)


def test_undamped_and_always_damped_peaks_are_those_of_the_laws(swept):
    runs = swept.figures['runs']
    assert runs[sweep.OFF]['resonance_peak_m'] == pytest.approx(3.47e-3, rel=0.03)
    assert runs[sweep.ALWAYS]['resonance_peak_m'] == pytest.approx(0.73e-3, rel=0.03)


def test_damping_comes_and_goes_and_only_the_hydromount_shows_a_resonance_peak(swept):
    friction = swept.figures['runs'][sweep.FRICTION]
    assert friction['switched_on_hz'] == pytest.approx([6.66], abs=0.03)
    assert friction['switched_off_hz'] == pytest.approx([11.57], abs=0.06)
    assert friction['defined_peak'] is None
    assert swept.figures['runs'][sweep.HYDRO]['defined_peak'][0] == 9.5
    assert friction['isolation_rms'] == [None, None, None]  # the sweep ends before the bands of isolation
    assert [each.holds for each in swept.claims] == [Holds.YES] * 3 + [Holds.NOT_COMPARABLE]


def test_a_resonance_peak_is_a_local_maximum_well_above_the_switch_on_level():
    middles = [5.5, 6.5, 7.5, 8.5]
    assert defined_peak(middles, [0.4, 1.1, 0.6, 0.5], 0.8) == (6.5, 1.1)
    assert defined_peak(middles, [0.4, 0.9, 0.6, 0.5], 0.8) is None
    assert defined_peak(middles, [0.4, 1.1, 1.2, 1.3], 0.8) is None


# Gap.


def test_damping_comes_one_period_after_the_level_is_exceeded_and_leaves_less_ringing(gaps):
    check(gaps)
    for found in gaps.figures['gaps'].values():
        assert 0.125 <= found['on_delay_s'] <= 0.200
        assert found['off_delay_in_band_s'] == pytest.approx(0.126, abs=0.002)
        assert found['rms_m'][motorway_gap.FRICTION] < 0.6 * found['rms_m'][motorway_gap.OFF]
    on_hydro = gaps.claims[-1]
    assert [on_hydro.holds, on_hydro.ours.holds] == [Holds.PARTLY, Holds.YES]
