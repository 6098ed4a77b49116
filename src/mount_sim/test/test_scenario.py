"""From the parameters of a scenario to its excitation."""

import numpy as np
import pytest

from engine_mount.recordings.signals.signal import SignalError
from mount_models.quantity import ParameterError
from mount_sim.excitation.excitation import Seat
from mount_sim.excitation.scenario import STEP_TIME, build_excitation


def _refusal(chosen):
    with pytest.raises(ParameterError) as caught:
        build_excitation(chosen)
    return str(caught.value)


def test_an_unknown_scenario_is_refused_with_the_known_ones(parameters):
    assert _refusal(parameters(scenario='race')) == (
        "scenario 'race' is unknown; known are motorway, bench, sweep, recorded, road"
    )


def test_the_bench_moves_the_mount_on_a_sine_faded_in_over_one_period(parameters):
    excitation = build_excitation(parameters(scenario='bench', timeline__duration=2.0, timeline__start=1.5))
    assert (excitation.seat, excitation.start, excitation.step_time) == (Seat.BENCH, 1.5, STEP_TIME)
    assert excitation.duration == pytest.approx(2.0)
    times = np.arange(40_000) * STEP_TIME
    sine = 1e-3 * np.sin(2 * np.pi * 8.0 * times)
    np.testing.assert_allclose(excitation.values[2500:], sine[2500:], atol=1e-15)
    # it begins and ends its fade without a corner: no acceleration far above the sine's own
    acceleration = np.abs(np.diff(np.r_[0.0, 0.0, excitation.values[:]], 2)) / STEP_TIME**2
    assert acceleration.max() < 2.5 * 1e-3 * (2 * np.pi * 8.0) ** 2
    assert np.abs(excitation.values[:]).max() <= 1e-3


def test_the_gap_comes_after_a_third_of_the_drive_unless_told_otherwise(parameters):
    def entry(**changes):
        chosen = parameters(
            timeline__duration=6.0, motorway__roughness=0.0, motorway__gap_depth=0.03, **changes
        )
        values = build_excitation(chosen).values[:]
        hollow = np.flatnonzero(values < -1e-9) * STEP_TIME
        return hollow[0], hollow[-1], values.min()

    begin, end, depth = entry()
    assert begin == pytest.approx(2.0, abs=2 * STEP_TIME)
    assert end - begin == pytest.approx(1.0 / 33.0, abs=3 * STEP_TIME)
    assert depth == pytest.approx(-0.03, rel=1e-4)
    assert entry(motorway__gap_time=4.5)[0] == pytest.approx(4.5, abs=2 * STEP_TIME)


def test_a_gap_after_the_end_of_the_drive_is_refused(parameters):
    chosen = parameters(timeline__duration=3.0, motorway__gap_time=3.0)
    assert 'motorway.gap_time (3 s) must lie before the end of the drive (3 s)' in _refusal(chosen)
    without = parameters(timeline__duration=3.0, motorway__gap_time=3.0, motorway__gap_depth=0.0)
    assert build_excitation(without).seat is Seat.VEHICLE


def test_without_a_duration_the_drive_takes_15_s(parameters):
    for scenario in ('bench', 'motorway'):
        assert build_excitation(parameters(scenario=scenario)).duration == pytest.approx(15.0)


def test_the_road_belongs_to_the_seed(parameters):
    def road(seed):
        return build_excitation(parameters(timeline__duration=1.0, seed=seed)).values[:]

    np.testing.assert_array_equal(road(7), road(7))
    assert np.abs(road(7) - road(8)).max() > 1e-4
    smooth = build_excitation(parameters(timeline__duration=1.0, motorway__roughness=0.0, seed=7)).values[:]
    assert np.abs(road(7) - smooth).max() > 1e-4


def test_the_sweep_shakes_the_wheel_from_1_to_50_hz_in_49_s(parameters):
    excitation = build_excitation(parameters(scenario='sweep'))
    assert excitation.seat is Seat.VEHICLE
    assert excitation.duration == pytest.approx(49.0)
    times = np.arange(len(excitation.values)) * STEP_TIME
    phase = 2.0 * np.pi * (times + 0.5 * times**2)
    height = -0.12 / (2.0 * np.pi * (1.0 + times)) * np.cos(phase) * np.minimum(times, 1.0)
    np.testing.assert_allclose(excitation.values[:], height, atol=1e-12)


def test_a_sweep_takes_its_own_frequencies_rate_and_amplitude(parameters):
    chosen = parameters(
        scenario='sweep', sweep__first_frequency=5.0, sweep__last_frequency=9.0, sweep__rate=2.0,
        sweep__velocity_amplitude=0.06, sweep__ramp_in=0.0,
    )  # fmt: skip
    excitation = build_excitation(chosen)
    assert excitation.duration == pytest.approx(2.0)
    velocity = np.diff(excitation.values[:]) / STEP_TIME
    assert np.abs(velocity).max() == pytest.approx(0.06, rel=0.02)
    crossings = np.flatnonzero(np.diff(excitation.values[:] > 0.0))  # exact zeros count once
    assert len(crossings) == pytest.approx(2.0 * 0.5 * (5.0 + 9.0) * 2.0, abs=1)


def test_an_impossible_sweep_is_refused(parameters):
    down = parameters(scenario='sweep', sweep__first_frequency=20.0, sweep__last_frequency=20.0)
    assert _refusal(down) == ('sweep.last_frequency (20 Hz) must lie above sweep.first_frequency (20 Hz)')
    assert build_excitation(parameters(scenario='sweep', timeline__duration=3.0)).duration == pytest.approx(
        3.0
    )
    long = parameters(scenario='sweep', timeline__duration=60.0)
    assert 'duration (60 s) is longer than the sweep from 1 to 50 Hz (49 s)' in _refusal(long)


@pytest.mark.parametrize('scenario', ['motorway', 'sweep', 'recorded'])
def test_the_idle_force_is_a_sine_with_its_second_harmonic(parameters, recording, scenario):
    chosen = {'scenario': scenario, 'timeline__duration': 2.0, 'recorded__file': recording}
    assert build_excitation(parameters(**chosen)).engine_forces is None
    excitation = build_excitation(parameters(**chosen, idle__amplitude=200.0))
    times = np.arange(40_000) * STEP_TIME
    force = 200.0 * (np.sin(2 * np.pi * 26.7 * times) + 0.4 * np.sin(2 * np.pi * 53.4 * times))
    np.testing.assert_allclose(excitation.engine_forces[:], force, atol=1e-7)
    other = build_excitation(
        parameters(**chosen, idle__amplitude=80.0, idle__frequency=30.0, idle__second_share=0.0)
    )
    np.testing.assert_allclose(other.engine_forces[:], 80.0 * np.sin(2 * np.pi * 30.0 * times), atol=1e-7)
    np.testing.assert_array_equal(other.values[:], excitation.values[:])


def test_a_tip_in_lifts_the_engine_once_and_adds_to_the_idle_force(parameters):
    pushed = {'tip_in__force': 400.0, 'tip_in__time': 0.2, 'tip_in__rise': 0.1}
    alone = build_excitation(parameters(timeline__duration=0.5, **pushed)).engine_forces
    for time, force in ((0.1, 0.0), (0.25, 200.0), (0.31, 400.0), (0.49, 400.0)):
        assert alone[:][round(time / STEP_TIME)] == pytest.approx(force)
    idle = build_excitation(parameters(timeline__duration=0.5, idle__amplitude=80.0)).engine_forces
    both = build_excitation(parameters(timeline__duration=0.5, idle__amplitude=80.0, **pushed)).engine_forces
    np.testing.assert_array_equal(both[:], idle[:] + alone[:])
    np.testing.assert_array_equal(both[17:4242], both[:][17:4242])


def test_a_tip_in_on_the_bench_is_refused(parameters):
    refusal = _refusal(parameters(scenario='bench', tip_in__force=-20.0))
    assert refusal.startswith('tip_in.force (-20 N) has no effect in scenario bench')


def test_an_idle_force_on_the_bench_is_refused(parameters):
    refusal = _refusal(parameters(scenario='bench', idle__amplitude=200.0))
    assert refusal.startswith('idle.amplitude (200 N) has no effect in scenario bench')


@pytest.fixture
def recording(tmp_path):
    times = np.arange(2000) / 200.0
    np.save(tmp_path / 'z_value.npy', np.sin(2 * np.pi * 8.0 * times))
    np.save(tmp_path / 'z_t.npy', times)
    return str(tmp_path / 'z_value.npy')


def test_a_recording_shakes_the_chassis_and_gives_its_length(parameters, recording):
    excitation = build_excitation(parameters(scenario='recorded', recorded__file=recording))
    assert excitation.seat is Seat.ACCELERATED_CHASSIS
    assert excitation.duration == pytest.approx(9.995, abs=1e-4)
    shorter = build_excitation(
        parameters(scenario='recorded', recorded__file=recording, timeline__duration=4.0)
    )
    np.testing.assert_array_equal(shorter.values[:], excitation.values[:80_000])


def test_what_was_done_to_a_recording_is_told(parameters, recording):
    assert build_excitation(parameters(scenario='recorded', recorded__file=recording)).notes == ()
    times = np.load(recording.replace('value', 't'))
    times[500] = times[499] + 1e-6
    np.save(recording.replace('value', 't'), times)
    (note,) = build_excitation(parameters(scenario='recorded', recorded__file=recording)).notes
    assert note.startswith('z.0: taken as evenly spaced at 200 Hz: ')


def test_a_recording_is_scaled(parameters, recording):
    plain, scaled = (
        build_excitation(parameters(scenario='recorded', recorded__file=recording, recorded__scale=scale))
        for scale in (1.0, -9.81)
    )
    np.testing.assert_allclose(scaled.values[:], -9.81 * plain.values[:])


def test_what_a_recording_cannot_give_is_refused(parameters, recording):
    assert 'scenario recorded needs a file: CSV, NPY, JSON or MCAP' in _refusal(
        parameters(scenario='recorded')
    )
    too_long = parameters(scenario='recorded', recorded__file=recording, timeline__duration=10.5)
    assert 'duration (10.5 s) is longer than the recording z.0 (9.995 s)' in _refusal(too_long)


def road_file(folder, heights, period=1e-3):
    np.save(folder / 'road_value.npy', heights)
    np.save(folder / 'road_t.npy', period * np.arange(heights.size))
    return str(folder / 'road_value.npy')


def test_a_measured_road_goes_under_the_wheel_as_it_is(parameters, tmp_path):
    times = 1e-3 * np.arange(3001)
    file = road_file(tmp_path, 0.01 * np.sin(2 * np.pi * 5.0 * times))
    excitation = build_excitation(parameters(scenario='road', road__file=file))
    assert excitation.seat is Seat.VEHICLE
    assert excitation.duration == pytest.approx(3.0, abs=0.001)
    steps = np.arange(len(excitation.values)) * STEP_TIME
    middle = slice(2000, -2000)
    wanted = 0.01 * np.sin(2 * np.pi * 5.0 * steps)
    np.testing.assert_allclose(excitation.values[:][middle], wanted[middle], atol=5e-6)
    cut = build_excitation(parameters(scenario='road', road__file=file, timeline__duration=1.0))
    assert cut.duration == pytest.approx(1.0)


def test_a_measured_road_that_is_missing_too_short_or_in_another_unit_is_refused(parameters, tmp_path):
    assert 'scenario road needs a measured road' in _refusal(parameters(scenario='road'))
    file = road_file(tmp_path, 0.01 * np.sin(0.1 * np.arange(3001)))
    long = parameters(scenario='road', road__file=file, timeline__duration=9.0)
    assert 'is longer than the road road.0 (3.000 s)' in _refusal(long)
    file = road_file(tmp_path, 10.0 * np.sin(0.1 * np.arange(3001)))
    with pytest.raises(SignalError, match='is meant in m, without hills'):
        build_excitation(parameters(scenario='road', road__file=file))
