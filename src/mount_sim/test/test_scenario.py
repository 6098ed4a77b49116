"""From the parameters of a scenario to its excitation."""

import numpy as np
import pytest
from simulated_mounts import parameters

from mount_models.arithmetic.series import series_of
from mount_models.quantity import ParameterError
from mount_sim.excitation.building import build_excitation, write_excitation
from mount_sim.excitation.excitation import Excitation, Seat
from mount_sim.excitation.scenario import STEP_TIME


def _refusal(chosen):
    with pytest.raises(ParameterError) as caught:
        build_excitation(chosen)
    return str(caught.value)


def test_an_unknown_scenario_is_refused_with_the_known_ones():
    assert _refusal(parameters(scenario='race')) == (
        "scenario 'race' is unknown; known are motorway, bench, sweep, recorded, road"
    )


def test_the_bench_moves_the_mount_on_a_sine_faded_in_over_one_period():
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


def test_the_gap_comes_after_a_third_of_the_drive_unless_told_otherwise():
    def entry(**changes):
        chosen = parameters(
            timeline__duration=6.0, motorway__roughness=0.0, motorway__gap_depth=0.03, **changes
        )
        values = build_excitation(chosen).values[:]
        assert values.min() == pytest.approx(-0.03, rel=1e-4)
        return np.flatnonzero(values < -1e-9)[0] * STEP_TIME

    assert entry() == pytest.approx(2.0, abs=2 * STEP_TIME)
    assert entry(motorway__gap_time=4.5) == pytest.approx(4.5, abs=2 * STEP_TIME)


def test_a_gap_after_the_end_of_the_drive_is_refused():
    chosen = parameters(timeline__duration=3.0, motorway__gap_time=3.0)
    assert 'motorway.gap_time (3 s) must lie before the end of the drive (3 s)' in _refusal(chosen)
    without = parameters(timeline__duration=3.0, motorway__gap_time=3.0, motorway__gap_depth=0.0)
    assert build_excitation(without).seat is Seat.VEHICLE


def test_an_impossible_sweep_is_refused():
    down = parameters(scenario='sweep', sweep__first_frequency=20.0, sweep__last_frequency=20.0)
    assert _refusal(down) == ('sweep.last_frequency (20 Hz) must lie above sweep.first_frequency (20 Hz)')
    assert build_excitation(parameters(scenario='sweep', timeline__duration=3.0)).duration == pytest.approx(
        3.0
    )
    long = parameters(scenario='sweep', timeline__duration=60.0)
    assert 'duration (60 s) is longer than the sweep from 1 to 50 Hz (49 s)' in _refusal(long)


@pytest.mark.parametrize('scenario', ['motorway', 'sweep', 'recorded'])
def test_the_idle_force_is_a_sine_with_its_second_harmonic(recording, scenario):
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


def test_cylinders_that_differ_shake_the_engine_at_half_orders_of_its_crank():
    of_engine = {'timeline__duration': 2.0, 'idle__amplitude': 100.0, 'idle__frequency': 40.0}
    even, uneven = (
        build_excitation(parameters(**of_engine, idle__uneven_share=share)).engine_forces[:]
        for share in (0, 0.3)
    )
    amplitudes = 2.0 * np.abs(np.fft.rfft(uneven - even)) / uneven.size
    expected = np.zeros_like(amplitudes)
    expected[[20, 40, 60, 100, 120]] = 30.0  # each 0.5 Hz; the crank turns 20 times a second
    np.testing.assert_allclose(amplitudes, expected, atol=1e-6)


def test_a_tip_in_lifts_the_engine_once_and_adds_to_the_idle_force():
    pushed = {'tip_in__force': 400.0, 'tip_in__time': 0.2, 'tip_in__rise': 0.1}
    alone = build_excitation(parameters(timeline__duration=0.5, **pushed)).engine_forces
    for time, force in ((0.1, 0.0), (0.25, 200.0), (0.31, 400.0), (0.49, 400.0)):
        assert alone[:][round(time / STEP_TIME)] == pytest.approx(force)
    idle = build_excitation(parameters(timeline__duration=0.5, idle__amplitude=80.0)).engine_forces
    both = build_excitation(parameters(timeline__duration=0.5, idle__amplitude=80.0, **pushed)).engine_forces
    np.testing.assert_array_equal(both[:], idle[:] + alone[:])
    np.testing.assert_array_equal(both[17:4242], both[:][17:4242])


@pytest.fixture
def recording(tmp_path):
    """Return an array file of 10 s; its numbers are those of a sine in m/s^2."""
    shaken = sim_excitation(
        Seat.ACCELERATED_CHASSIS, np.sin(2 * np.pi * 8.0 * STEP_TIME * np.arange(200_000))
    )
    return str(write_excitation(tmp_path / 'z.npy', shaken))


def sim_excitation(seat, values):
    return Excitation(seat, series_of(values), STEP_TIME, 0.0)


@pytest.mark.parametrize(
    ('scenario', 'seat'), [('recorded', Seat.ACCELERATED_CHASSIS), ('road', Seat.VEHICLE)]
)
def test_an_array_shakes_the_plant_to_the_bit_and_gives_its_length(tmp_path, scenario, seat):
    values = np.random.default_rng(2).standard_normal(100_000)
    file = write_excitation(tmp_path / 'excitation.npy', sim_excitation(seat, values))
    chosen = {'scenario': scenario, f'{scenario}__file': str(file)}
    excitation = build_excitation(parameters(**chosen))
    assert (excitation.seat, excitation.duration) == (seat, pytest.approx(5.0))
    assert excitation.values[:].tobytes() == values.tobytes()
    cut = build_excitation(parameters(**chosen, timeline__duration=1.0))
    assert cut.values[:].tobytes() == values[:20_000].tobytes()
    too_long = parameters(**chosen, timeline__duration=5.5)
    assert 'duration (5.5 s) is longer than' in _refusal(too_long)


@pytest.mark.parametrize(
    ('content', 'reason'),
    [
        (None, 'cannot be read as NPY'),
        (np.ones(9), 'is no array of at least one road_height, each 50 us'),
        (np.ones(9, [('chassis_acceleration', '<f8')]), 'is no array of at least one road_height'),
        (np.ones(0, [('road_height', '<f8')]), 'is no array of at least one road_height'),
        (np.array([(0.0,), (np.nan,)], [('road_height', '<f8')]), 'is not finite at number 1'),
    ],
)
def test_an_array_of_another_kind_is_refused(tmp_path, content, reason):
    file = tmp_path / 'road.npy'
    if content is not None:
        np.save(file, content)
    assert reason in _refusal(parameters(scenario='road', road__file=str(file)))


def test_what_only_the_desk_can_read_is_refused(recording):
    assert 'scenario recorded needs a file: CSV, NPY' in _refusal(parameters(scenario='recorded'))
    assert 'scenario road needs a measured road' in _refusal(parameters(scenario='road'))
    chosen = parameters(scenario='recorded', recorded__file=recording, recorded__scale=-1.0)
    assert 'are for engine-mount drive, which makes the excitation of a recording' in _refusal(chosen)


@pytest.mark.parametrize(
    ('changes', 'reason'),
    [
        ({'tip_in__force': -20.0}, 'tip_in.force (-20 N) has no effect in scenario bench'),
        ({'idle__amplitude': 200.0}, 'idle.amplitude (200 N) has no effect in scenario bench'),
    ],
)
def test_a_force_on_the_engine_is_refused_on_the_bench(changes, reason):
    assert _refusal(parameters(scenario='bench', **changes)).startswith(reason)
