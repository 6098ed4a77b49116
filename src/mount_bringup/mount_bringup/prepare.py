"""Compiles what the nodes would compile at their first start: the executable `mount_prepare`."""

import itertools
from collections.abc import Sequence

from mount_control.controller import load_compiled_law
from mount_control.policy.registry import POLICIES
from mount_control.settings import control_settings
from mount_init.initialisation import load_compiled_laws
from mount_models.arithmetic.compiled import compilation_told
from mount_models.specimen import chosen_specimen
from mount_sim.excitation.building import build_excitation
from mount_sim.parameters import SimParameters
from mount_sim.plant.simulated_car import SimulatedCar

_SCENARIOS = ('bench', 'motorway')
_MOUNTS = ('', 'left,right')


def prepare(scenarios: Sequence[str] = _SCENARIOS, policies: Sequence[str] = tuple(POLICIES)) -> None:
    """Compile the laws of these policies and the plant of `scenarios`, or load what is compiled already."""
    specimen = chosen_specimen('', '')
    load_compiled_laws(specimen)
    for policy in policies:
        load_compiled_law(control_settings({'policy': policy}, specimen))
    for scenario, mounts in itertools.product(scenarios, _MOUNTS):
        excitation = build_excitation(SimParameters(scenario=scenario))
        for mount in SimulatedCar({'scenario': scenario, 'mounts': mounts}, excitation).mounts.values():
            mount.measure()
            mount.advance(0.0)


def main() -> None:
    """Compile the laws for this machine, so that the first start of the graph need not."""
    with compilation_told(_say):
        prepare()
    _say('the laws are compiled for this machine')


def _say(sentence: str) -> None:
    print(sentence, flush=True)
