"""What the node says of its result."""

import pytest

from mount_init.node import verdict, wear_reserve
from mount_init.parameters import InitParameters
from mount_ros.nodes.diagnostics import Level


@pytest.fixture(scope='module')
def result(simulated_actuator, specimen, run_initialisation):
    return run_initialisation(
        simulated_actuator(noise=0.01), specimen, InitParameters(coil_temperature_celsius=20.0)
    )


def test_a_good_result_is_told_with_its_figures(result, specimen):
    said = verdict(result, specimen)
    assert said.level == Level.OK
    assert said.sentence.startswith('rest gap 50')
    assert 'contact gap 34' in said.sentence
    assert said.figures['samples_used'] == 2750
    assert float(said.figures['contact_gap_um']) == pytest.approx(result.contact_gap * 1e6, abs=0.01)


def test_worn_pads_are_a_warning_before_they_are_a_refusal(simulated_actuator, specimen, run_initialisation):
    worn = run_initialisation(simulated_actuator(contact_gap=295e-6), specimen)
    assert 0.0 < wear_reserve(worn, specimen) < 10e-6
    said = verdict(worn, specimen)
    assert said.level == Level.WARN
    assert 'pads are nearly worn' in said.sentence
    assert 'replace the pads' in said.sentence
