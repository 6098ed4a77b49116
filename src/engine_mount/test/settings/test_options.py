"""Settings as the user writes them, before a node or a core run has them."""

import numpy as np
import pytest

from engine_mount.settings.options import owned, settings_of_options
from mount_bringup.settings import SettingError, checked_settings, defaults_of_nodes
from mount_control.policy import continuous_viscous
from mount_control.policy.registry import POLICIES
from mount_models.damper import damper_curve
from mount_models.quantity import ParameterError

POINTS = {'velocity': [0.0, 0.004, 0.1], 'force': [0.0, 0.0, 200.0]}


@pytest.mark.parametrize(
    ('option', 'damper'),
    [
        ('viscous_2500', 'viscous_2500'),
        ('{law: viscous, dead_zone: 0.002}', {'law': 'viscous', 'dead_zone': 0.002}),
        ('{velocity: [0, 0.004, 0.1], force: [0, 0, 200]}', POINTS),
    ],
)
def test_a_damper_is_given_to_core_and_nodes_in_one_text(option, damper):
    settings = checked_settings(settings_of_options([f'mount_control.damper={option}']))
    text = settings['mount_control']['damper']
    assert isinstance(text, str)  # what a node can declare
    assert np.array_equal(damper_curve(text).table, damper_curve(damper).table)


@pytest.mark.parametrize(
    ('name', 'meant'),
    [
        ('mount_sim.seed', ('mount_sim', 'seed')),
        ('continuous_viscous.quality', ('mount_control', 'continuous_viscous.quality')),
        ('sample_rate', ('mount_control', 'sample_rate')),  # each node has one
        ('left/mount_control.policy', ('left/mount_control', 'policy')),
        ('mount_sim.mount_left.friction.scale', ('mount_sim', 'mount_left.friction.scale')),
        ('mount_sim.sede', ('mount_sim', 'sede')),  # refused where the types are known
    ],
)
def test_a_parameter_is_named_with_its_node_or_without(name, meant):
    assert owned(name) == meant


@pytest.mark.parametrize(
    ('name', 'sentence'),
    [
        ('sede', "'sede' is no parameter of any node; did you mean seed"),
        ('coil.duration', "'coil.duration' is a parameter of a, b: write which, as in a.coil.duration"),
    ],
)
def test_a_name_that_is_no_ones_or_several_ones_is_refused_with_what_to_write(name, sentence):
    known = {'a': {'coil.duration': 1.0}, 'b': {'coil.duration': 1.0}} if name.startswith('coil') else None
    with pytest.raises(ParameterError) as refusal:
        owned(name, known)
    assert sentence in str(refusal.value)


def test_a_policy_that_is_registered_later_has_its_parameters(monkeypatch):
    before = defaults_of_nodes()['mount_control']
    monkeypatch.setitem(POLICIES, 'another', continuous_viscous)
    assert {name for name in defaults_of_nodes()['mount_control'] if name not in before} == {
        f'another.{name.partition(".")[2]}' for name in before if name.startswith('continuous_viscous.')
    }


@pytest.mark.parametrize('option', ['seed', '=1', 'mount_sim.seed'])
def test_a_setting_without_name_or_value_is_a_wrong_use(option):
    with pytest.raises(SettingError, match='write NAME=VALUE or NODE'):
        settings_of_options([option])
