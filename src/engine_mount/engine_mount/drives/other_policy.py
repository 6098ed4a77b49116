"""Refuses parameters of another policy than the chosen one: on the desk they are a mistake."""

from collections.abc import Mapping
from typing import Any

from mount_control.settings import ControlParameters, without_effect
from mount_models.quantity import ParameterError


class NoEffectError(ParameterError):
    """A parameter belongs to another policy than the chosen one; the text names both."""


def check_effect(values: Mapping[str, Any], chosen: str = '') -> None:
    """Raise `NoEffectError` if {parameter: value} name one of another policy than the chosen one.

    The chosen policy is the one in `values`, else `chosen`, else the default.
    """
    policy = values.get('policy') or chosen or ControlParameters().policy
    if sentence := without_effect(values, policy):
        raise NoEffectError(sentence)
