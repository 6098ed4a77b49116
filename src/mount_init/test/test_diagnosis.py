"""What the node says of its result."""

import pytest
from simulated_actuator import SPECIMEN, SimulatedActuator, run_initialisation

from mount_init.checks import wear_reserve
from mount_init.node import verdict
from mount_init.parameters import InitParameters
from mount_ros.nodes.diagnostics import Level


@pytest.fixture(scope='module')
def result():
    return run_initialisation(
        SimulatedActuator(noise=0.01), SPECIMEN, InitParameters(coil_temperature_celsius=20.0)
    )


def test_a_good_result_is_told_with_its_figures(result):
    said = verdict(result, SPECIMEN)
    assert said.level == Level.OK
    assert said.sentence.startswith('rest gap 50')
    assert 'contact gap 34' in said.sentence
    assert said.figures['samples_used'] == 2750
    assert float(said.figures['contact_gap_um']) == pytest.approx(result.contact_gap * 1e6, abs=0.01)


def test_worn_pads_are_a_warning_before_they_are_a_refusal():
    worn = run_initialisation(SimulatedActuator(contact_gap=295e-6))
    assert 0.0 < wear_reserve(worn.contact_gap, worn.table[1, -1], SPECIMEN) < 10e-6
    said = verdict(worn, SPECIMEN)
    assert said.level == Level.WARN
    assert 'pads are nearly worn' in said.sentence
    assert 'replace the pads' in said.sentence
