"""What a report computes, against signals whose answer is known."""

import numpy as np
import pytest

from engine_mount.recordings.losses import Losses
from engine_mount.reports.sections import motion
from engine_mount.reports.sections.overview import findings
from engine_mount.reports.sections.periodic import (
    amplitude_density,
    cycle_work,
    decibels,
    distortion,
    dominant_sine,
    evenly,
    harmonics,
    rms_in_bands,
    vertical_weighting,
    whole_periods,
)
from engine_mount.reports.sections.run import coil_load
from engine_mount.reports.sections.section import GOOD, LOOK, UNKNOWN
from engine_mount.reports.sections.subject import QUANTITIES, Run, Signal, Subject

TIME = np.arange(4000) * 1e-3


class Known(Subject):
    """A subject of known signals, without a recording."""

    def __init__(self, place=0, run=Run(), **signals):  # noqa: B008
        self.name, self.prefix, self.missing, self.comparison = f'N{place}', '', [], None
        self._several, self.look = True, ('#000000', 'solid')
        self._signals = dict.fromkeys(pair for pairs in QUANTITIES.values() for pair in pairs)
        self._signals |= {QUANTITIES[name][0]: signal for name, signal in signals.items()}
        self.run, self.beside, self.session = run, 'not known', ''


@pytest.mark.parametrize(('frequency', 'close', 'amplitude'), [(8.137, 1e-6, 1e-6), (0.2, 1e-3, 1e-2)])
def test_the_frequency_of_a_sine_is_found_between_the_lines_of_the_spectrum(frequency, close, amplitude):
    """Also where less than two periods were recorded."""
    sine = dominant_sine(TIME, 0.3 + 2.0 * np.sin(2 * np.pi * frequency * TIME + 1.0))
    assert sine.frequency == pytest.approx(frequency, rel=close)
    assert sine.amplitude == pytest.approx(2.0, rel=amplitude)
    assert sine.share == pytest.approx(1.0, abs=1e-6)


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
    with pytest.raises(ValueError, match='need two periods'):
        harmonics(TIME[:200], TIME[:200], 8.0)


def test_amplitudes_are_told_in_decibels_and_none_is_no_dot():
    found = decibels(np.array([100.0, 1.0, 0.0]))
    assert found[:2].tolist() == [40.0, 0.0]
    assert np.isnan(found[2])


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


def test_the_rms_of_a_band_is_that_of_its_sine_weighted_as_people_feel_it():
    values = np.sqrt(2.0) * 3.0 * np.sin(2 * np.pi * 16.0 * np.arange(20_000) / 2000.0)
    found = rms_in_bands(values, [(12.0, 20.0), (20.0, 60.0), (20.0, 1001.0)], 2000.0)
    assert found == pytest.approx([3.0, 0.0, np.nan], abs=1e-6, nan_ok=True)
    known = {0.5: 0.418, 2.0: 0.531, 8.0: 1.036, 80.0: 0.132}  # ISO 2631-1:1997, Table 3
    assert vertical_weighting(np.array([*known])) == pytest.approx([*known.values()], abs=1e-3)
    assert rms_in_bands(values, [(12.0, 20.0)], 2000.0, vertical_weighting) == pytest.approx(
        [2.306], abs=1e-3
    )


def test_missing_and_unknown_samples_are_bridged_and_counted():
    values = TIME.copy()
    values[100:110] = np.nan
    kept = np.delete(np.arange(len(TIME)), [500, 501])
    grid, bridged, made_up = evenly(TIME[kept], values[kept], 1000.0)
    assert made_up == 12
    assert grid == pytest.approx(TIME)
    assert bridged == pytest.approx(TIME)


def test_the_heat_of_a_coil_is_that_of_the_rms_current():
    current = np.where(TIME < 1.0, 3.0, 1.0)
    load = coil_load(TIME, current, 2.5)
    assert load.rms_current == pytest.approx(np.sqrt(3.0))
    assert load.mean_heat == pytest.approx(7.5)
    assert load.energy == pytest.approx(30.0)


def test_unknown_current_is_neither_load_nor_time():
    load = coil_load(TIME, np.where(TIME < 2.0, 2.0, np.nan), 1.0)
    assert load.duration == pytest.approx(2.0)
    assert load.rms_current == pytest.approx(2.0)
    unknown = np.full(len(TIME), np.nan)
    assert np.isnan(coil_load(TIME, unknown, 1.0).rms_current)


def test_displacements_are_drawn_in_mm_with_the_levels_of_the_policy_and_their_difference_below():
    levels = {'switch-on level': 8e-4, 'switch-off level': 3.5e-4}
    a = Known(0, Run(levels=levels), displacement=Signal(TIME, np.zeros(len(TIME))))
    b = Known(1, displacement=Signal(TIME + 5e-4, np.full(len(TIME), 1e-3)))
    b.comparison = object()
    above, below = motion.traces([a, b]).chart.panels
    assert [curve.y[0] for curve in above.curves] == pytest.approx([1.0, 0.0])  # the first one on top
    assert [level.value for level in above.levels] == pytest.approx([0.8, 0.35])
    (curve,) = below.curves
    assert curve.y[:-1] == pytest.approx(1.0)
    assert np.isnan(curve.y[-1])  # behind the end of A


SOUND = Losses(
    samples=1000,
    lost_samples=0,
    lost_messages=0,
    asked=1000,
    unanswered=0,
    late=0,
    misdated=0,
    faults=(),
    whole=True,
)


@pytest.mark.parametrize(
    ('lacking', 'judgement'),
    [
        ({}, GOOD),
        ({'lost_samples': 1, 'lost_messages': 2}, LOOK),
        ({'lost_messages': 1}, LOOK),
        ({'unanswered': 1}, LOOK),
        ({'misdated': 1}, LOOK),
        ({'whole': False}, LOOK),
        ({'lost_samples': None}, GOOD),
        ({'lost_samples': None, 'lost_messages': None}, UNKNOWN),
    ],
)
def test_whatever_is_lost_unanswered_or_misdated_is_to_be_looked_at(lacking, judgement):
    subject = Known()
    subject.losses = SOUND._replace(**lacking)
    judged = {finding.what: finding.judgement for finding in findings(subject)}
    assert judged['Losses'] == judgement
