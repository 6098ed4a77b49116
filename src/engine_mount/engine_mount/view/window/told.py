"""What viewers are told, as plain values that JSON can carry."""

import math
from collections.abc import Iterable
from typing import Any

from engine_mount.reports.drawing.style import COLOUR_OF
from engine_mount.view.window.model import WINDOW, Interval, Model
from engine_mount.view.window.state import GraphState, Happening
from engine_mount.view.window.traces import INTERVALS_PER_SECOND, LATENCY, TRACES

_UM = 1e6
_EVENTS = 12  # chosen: shown, the last one first
_LEVELS = ('ok', 'warning', 'error', 'silent')
_CAN = ('lost', 'corrupt', 'late', 'resent', 'wrong_sequence', 'error_frames', 'refused', 'setpoint_timeouts')


def told_panels(model: Model) -> list[dict[str, Any]]:
    """Return the panels with their lines, in the order in which they are drawn."""
    panels: dict[str, dict[str, Any]] = {}
    for trace in (*TRACES, LATENCY):
        panel = panels.setdefault(trace.panel, {'title': trace.panel, 'unit': trace.unit, 'lines': []})
        panel['lines'].append(_line(trace.key, trace.label))
    displacement = panels['displacement']
    alternatives = model.beside.alternatives if model.beside is not None else ()
    displacement['lines'] += [_line(f'beside.{one.key}', one.label) for one in alternatives]
    displacement['levels'] = [{'label': label, 'value': value} for label, value in model.levels().items()]
    return list(panels.values())


def told_intervals(intervals: Iterable[Interval]) -> list[list[Any]]:
    """Return [number, time s, {key: [least, highest]}] of each interval, without what is not known."""
    return [[one.number, round(one.time, 4), _known(one)] for one in intervals]


def told_state(model: Model) -> dict[str, Any]:
    """Return the state of the graph: nodes, gap, coil, losses, events."""
    state, silent = model.state, model.silent_nodes
    return {
        'scenario': state.scenario,
        'nodes': [
            {
                'name': name,
                'level': _LEVELS[3 if name in silent else min(node.level, 2)],
                'sentence': 'says nothing any more' if name in silent else node.sentence,
                'state': node.figures.get('state', ''),
            }
            for name, node in sorted(state.nodes.items())
        ],
        'values': [{'name': name, 'value': value} for name, value in values(state)],
        'events': [_told_event(event, model.zero) for event in list(state.events)[-_EVENTS:][::-1]],
    }


def _told_event(event: Happening, zero: int | None) -> dict[str, Any]:
    time = 0.0 if zero is None else round((event.time - zero) * 1e-9, 3)
    return {'time': time, 'kind': event.kind, 'text': event.text}


def values(state: GraphState) -> list[tuple[str, str]]:
    """Return the figures beside the panels, by name, with units."""
    gap = {name: value * _UM for name, value in state.gap.items()}
    found = [
        ('rest gap', _with_std(gap, 'rest_gap')),
        ('contact gap', _with_std(gap, 'contact_gap')),
        ('wear reserve', _with_unit(state.figure('mount_init', 'wear_reserve_um'), 'µm')),
        ('coil temperature', '' if math.isnan(state.coil_celsius) else f'{state.coil_celsius:.1f} °C'),
        ('policy', state.figure('mount_control', 'policy')),
        ('samples', state.figure('mount_driver', 'samples')),
        *((f'CAN {name.replace("_", " ")}', state.figure('mount_driver', name)) for name in _CAN),
        ('bridged', state.figure('mount_control', 'bridged')),
        ('recorded messages', state.figure('mount_recorder', 'kept')),
        ('not recorded', state.figure('mount_recorder', 'lost')),
    ]
    return [(name, value) for name, value in found if value]


def told_window() -> dict[str, float]:
    """Return how much is kept and how fine it is."""
    return {'seconds': WINDOW, 'per_second': INTERVALS_PER_SECOND}


def _line(key: str, label: str) -> dict[str, str]:
    return {'key': key, 'label': label, 'colour': COLOUR_OF.get(key.removeprefix('beside.'), '')}


def _known(interval: Interval) -> dict[str, list[float]]:
    return {
        key: [float(f'{low:.5g}'), float(f'{high:.5g}')]
        for key, (low, high) in interval.extents.items()
        if low == low
    }


def _with_std(gap: dict[str, float], name: str) -> str:
    if name not in gap:
        return ''
    return f'{gap[name]:.1f} ± {gap.get(f"{name}_std", math.nan):.1f} µm'


def _with_unit(text: str, unit: str) -> str:
    return f'{text} {unit}' if text else ''
