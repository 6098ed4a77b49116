"""The simulator's verdict on itself."""

from mount_ros.nodes.diagnostics import Level
from mount_sim.diagnosis import DRIVING, FINISHED, verdict
from mount_sim.loop import LoopFigures
from mount_sim.plant.mounts import ALONE
from mount_sim.plant.simulated_car import BeyondRange, Run

RUN = Run(samples=20_000, excitation_start=5000)


def _judged(lockstep=False, **changes):
    figures = LoopFigures(**{'samples': 4000, 'answered': 3990, 'wall_time': 2.0, **changes})
    return verdict({ALONE: figures}, RUN, {}, lockstep=lockstep)


def test_under_way_and_finished():
    assert (_judged().level, _judged().sentence) == (Level.OK, DRIVING)
    ended = _judged(samples=20_000, overruns=20_000)
    assert (ended.level, ended.sentence) == (Level.OK, FINISHED)


def test_figures_tell_the_progress():
    assert _judged().figures == {
        'samples': 4000,
        'samples_of_run': 20_000,
        'simulated_s': '4.000',
        'excitation_start_s': '5.000',
        'real_time_factor': '2.0000',
        'answered': 3990,
        'overruns': 0,
        'latency_median_s': 'nan',
        'latency_p99_s': 'nan',
        'beyond_range': 0,
        'first_beyond_range_s': 'nan',
        'fatal': False,
    }
    assert _judged(wall_time=0.0).figures['real_time_factor'] == 'nan'


def test_a_failure_is_an_error_and_names_the_sample_that_waits():
    judged = _judged(failure='sample 3999 (3.999 s) was not answered within 10 s')
    assert judged.level is Level.ERROR
    assert judged.sentence == 'sample 3999 (3.999 s) was not answered within 10 s'
    assert (judged.figures['fatal'], judged.figures['waiting_stamp']) == (True, 3_999_000_000)


def test_a_machine_too_busy_for_real_time_is_a_warning():
    assert _judged(overruns=200).level is Level.OK
    busy = _judged(overruns=201)
    assert busy.level is Level.WARN
    assert busy.sentence.startswith('201 of 4000 samples were late (limit 5 % of 10 s)')
    assert _judged(overruns=201, lockstep=True).level is Level.OK


def test_a_mount_beyond_the_range_of_its_sensor_is_a_warning_with_the_first_moment():
    judged = _judged(beyond_range=BeyondRange(3, 3.25), lockstep=True)
    assert judged.level is Level.WARN
    assert judged.sentence == (
        'the simulated mount moved beyond the 50 mm of its displacement sensor in 3 samples, first at '
        '3.250 s; they were sent as not valid and answered with 0 A: excite it less'
    )
    assert (judged.figures['beyond_range'], judged.figures['first_beyond_range_s']) == (3, '3.250')
