"""The sample rate of a graph: set for all its nodes at once, and the same in all of them."""

from collections.abc import Iterable, Mapping
from typing import Any

from mount_models.quantity import ParameterError
from mount_models.sampling import SAMPLE_RATE, sample_time_ns

NODES = ('mount_driver', 'mount_init', 'mount_control', 'mount_sim', 'mount_recorder')
"""The nodes that have the parameter `sample_rate`."""


def with_sample_rate(
    settings: Mapping[str, Mapping[str, Any]], sample_rate: float | None
) -> dict[str, dict[str, Any]]:
    """Return the settings with `sample_rate` (Hz) for every node; None changes nothing."""
    completed = {node: dict(values) for node, values in settings.items()}
    if sample_rate is not None:
        for node in NODES:
            completed.setdefault(node, {})['sample_rate'] = sample_rate
    return completed


def check_sample_rate(settings: Mapping[str, Mapping[str, Any]], nodes: Iterable[str] = NODES) -> float:
    """Return the rate (Hz) of the nodes of a graph; raises `ParameterError` unless they have the same."""
    rates = {node: settings.get(node, {}).get('sample_rate', SAMPLE_RATE) for node in nodes if node in NODES}
    (first, rate), *others = rates.items()
    for node, other in others:
        if other != rate:
            raise ParameterError(
                f'{node}.sample_rate ({other:g} Hz) must equal {first}.sample_rate ({rate:g} Hz); set one '
                'for the whole graph: --sample-rate of a drive, sample_rate:= of a launch file'
            )
    sample_time_ns(rate)
    return float(rate)
