"""What shakes the plant is made in blocks: the same in any of them, and never more of it at a time."""

import hashlib
import tracemalloc

import numpy as np
import pytest
from simulated_mounts import make_mount, parameters

from mount_models.arithmetic.series import series_of
from mount_sim.excitation.building import build_excitation, write_excitation
from mount_sim.excitation.excitation import LONG_BLOCK, SHORT_BLOCK, Excitation, Seat, Shaking
from mount_sim.excitation.scenario import STEP_TIME

SECONDS = 1.5
CHOSEN = {
    'motorway': {'seed': 7, 'idle__amplitude': 80.0},
    'bench': {'bench__frequency': 3.7},
    'sweep': {'idle__amplitude': 5.0, 'idle__second_share': 0.0},
    'recorded': {'idle__amplitude': 5.0},
}
DIGESTS = {
    'motorway': 'e3b083d722cec044',
    'bench': 'd2a337b24c15b5c7',
    'sweep': 'f37fb2248dccbe4d',
}
"""Of values and engine forces as a whole: whoever changes them changes all drives."""


@pytest.fixture(scope='module')
def chosen(tmp_path_factory):
    """Return a function that gives the parameters of a scenario with a start between two blocks."""
    values = series_of(np.random.default_rng(5).standard_normal(40_000))
    shaken = Excitation(Seat.ACCELERATED_CHASSIS, values, STEP_TIME, 0.0)
    file = write_excitation(tmp_path_factory.mktemp('recording') / 'z.npy', shaken)

    def choose(scenario, **changes):
        given = {'timeline__start': 0.13, 'timeline__duration': SECONDS, 'recorded__file': str(file)}
        return parameters(scenario=scenario, **given | CHOSEN[scenario] | changes)

    return choose


@pytest.mark.parametrize('scenario', DIGESTS)
def test_a_drive_is_shaken_to_the_bit_as_ever(chosen, scenario):
    excitation = build_excitation(chosen(scenario))
    digest = hashlib.sha256(excitation.values[:].tobytes())
    if excitation.engine_forces is not None:
        digest.update(excitation.engine_forces[:].tobytes())
    assert digest.hexdigest()[:16] == DIGESTS[scenario]


@pytest.mark.parametrize('scenario', CHOSEN)
def test_rest_excitation_and_end_follow_each_other_however_they_are_asked_for(chosen, scenario):
    excitation = build_excitation(chosen(scenario, timeline__duration=1.40037))
    shaking, ahead = Shaking(excitation), Shaking(excitation)
    assert (shaking.start, shaking.samples) == (130, 1530)
    still = 0.0 if scenario == 'recorded' else excitation.values[-1:][0]
    for series, place, end in ((excitation.values, 0, still), (excitation.engine_forces, 1, 0.0)):
        driven = np.zeros(28_000) if series is None else series[:28_000]
        expected = np.concatenate([np.zeros(2600), driven, np.full(20 * 300, end)]).reshape(-1, 20)
        np.testing.assert_array_equal([shaking.at(sample)[place] for sample in range(1830)], expected)
        sample = 0
        while sample < 1830:
            rows = ahead.ahead(sample, min(77, 1830 - sample))[place]
            assert 1 <= len(rows) <= 77
            np.testing.assert_array_equal(rows, expected[sample : sample + len(rows)])
            sample += len(rows)


@pytest.mark.parametrize('scenario', ['motorway', 'bench'])
def test_two_hours_take_no_more_memory_than_some_blocks(scenario):
    make_mount(scenario=scenario)  # loads what is compiled
    tracemalloc.start()
    mount = make_mount(scenario=scenario, timeline__duration=7200.0)
    for _ in range(SHORT_BLOCK):
        mount.measure()
        mount.advance(0.0)
    mount.ahead(LONG_BLOCK)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert mount.run.samples == 7_200_000
    assert peak < 16e6  # the table of the road's waves is 3 MB
