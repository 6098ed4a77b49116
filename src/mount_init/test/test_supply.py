"""The supply during the ramp: whatever it is and does, it moves no gap, or the ramp is refused."""

import dataclasses

import numpy as np
import pytest
from simulated_actuator import SPECIMEN, SimulatedActuator, run_initialisation

from mount_init.errors import InitialisationError
from mount_init.parameters import InitParameters

NOISE = 0.01 * 0.5**0.5  # of each slope: 1 % on L_i
COLD = InitParameters(coil_temperature_celsius=20.0)


@pytest.fixture
def initialise_at():
    """Return a function that initialises with a supply (V) over the time (s) of the ramp."""

    def initialise(supply, seed=None, resistance=2.5, specimen=SPECIMEN, parameters=COLD):
        random = np.random.default_rng(seed)

        class Plant(SimulatedActuator):
            def sample(self):
                self.supply = supply(1e-3 * self.number)
                self.coil = self.coil._replace(link_voltage=self.supply, resistance=resistance)
                current, *slopes = super().sample()
                scatter = np.zeros(2) if seed is None else NOISE * random.standard_normal(2)
                return current, *(slopes * (1.0 + scatter))

        return run_initialisation(Plant(), specimen, parameters)

    return initialise


def step(before, after, time):
    return lambda now: before if now < time else after


def line(before, after, begin, duration):
    return lambda now: float(np.interp(now, [begin, begin + duration], [before, after]))


@pytest.mark.parametrize('volts', [9.0, 10.0, 12.0, 14.0, 14.8, 16.0])
def test_gaps_are_right_at_any_supply_that_the_driver_allows(initialise_at, volts):
    result = initialise_at(lambda _: volts)
    assert result.rest_gap * 1e6 == pytest.approx(508.0, abs=0.7)  # 507.4 at 14 V
    assert result.contact_gap * 1e6 == pytest.approx(349.0, abs=0.1)
    assert result.evidence.supply.whole.link_voltage == pytest.approx(volts, abs=0.01)


@pytest.mark.parametrize('share', [0.87, 1.13])
def test_a_coil_of_another_resistance_moves_no_gap(initialise_at, share):
    result = initialise_at(lambda _: 14.0, resistance=2.5 * share)
    assert result.contact_gap * 1e6 == pytest.approx(349.0, abs=0.2)


@pytest.mark.parametrize(
    'supply',
    [
        line(12.0, 14.5, 0.5, 1.0),  # the generator takes over
        line(12.0, 14.5, 1.3, 1.0),
        line(12.0, 14.5, 0.0, 2.7),
        step(12.0, 14.0, 0.85),  # amid the crossing
        step(14.0, 9.5, 1.86),
    ],
)
def test_a_supply_that_changes_moves_the_gap_by_less_than_the_noise(initialise_at, supply):
    for seed in range(3):
        result, steady = initialise_at(supply, seed), initialise_at(lambda _: 14.0, seed)
        assert not result.evidence.supply.steady
        assert result.contact_gap * 1e6 == pytest.approx(steady.contact_gap * 1e6, abs=0.5)
        assert result.rest_gap * 1e6 == pytest.approx(steady.rest_gap * 1e6, abs=0.3)


def test_at_the_supply_of_the_curves_readings_are_used_as_they_are_to_the_bit(initialise_at):
    result = initialise_at(lambda _: 14.0, seed=1)
    elsewhere = dataclasses.replace(SPECIMEN, bridge=SPECIMEN.bridge._replace(sample_phase=0.2))
    other = initialise_at(lambda _: 14.0, seed=1, specimen=elsewhere)
    assert (result.rest_gap, result.contact_gap) == (other.rest_gap, other.contact_gap)


@pytest.mark.parametrize('volts', [7.9, 18.2])
def test_a_supply_beyond_the_range_of_the_curves_is_refused(initialise_at, volts):
    with pytest.raises(InitialisationError, match=f'{volts} .. {volts} V. must lie within 8 .. 18 V'):
        initialise_at(lambda _: volts)


@pytest.mark.parametrize('volts', [7.9, 9.3])
def test_a_supply_that_cannot_drive_the_ramp_is_named(initialise_at, volts):
    hot = COLD._replace(coil_temperature_celsius=90.0)
    with pytest.raises(
        InitialisationError,
        match=r'supply drives no more than [\d.]+ A through the coil: .* lower peak',
    ):
        initialise_at(lambda _: volts, resistance=3.18, parameters=hot)


def test_a_supply_that_changes_hides_no_wrong_coil(initialise_at):
    for resistance in (0.1, 3.5):
        with pytest.raises(InitialisationError, match=r'changed between|resistance of the coil|must lie'):
            initialise_at(line(12.0, 14.5, 0.5, 1.0), resistance=resistance)


def test_a_supply_that_changes_too_unevenly_is_refused_with_its_range(initialise_at):
    with pytest.raises(
        InitialisationError, match=r'changed between 1[23]\.\d and 1[45]\.\d V .* while the supply is steady'
    ):
        initialise_at(lambda now: 14.0 + np.sin(44.0 * now))


def test_without_temperature_compensation_another_supply_is_refused(initialise_at):
    plain = dataclasses.replace(SPECIMEN, temperature=None)
    initialise_at(lambda _: 14.4, specimen=plain)
    with pytest.raises(InitialisationError, match=r'12\.0 V. must lie within 12\.9 \.\. 15\.1 V'):
        initialise_at(lambda _: 12.0, specimen=plain)
