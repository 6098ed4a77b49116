"""What `engine-mount identify drift` does: contact gap, offset current, friction over many recordings."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

from engine_mount.identification.drift.law import FEWEST, Drift, DriftError, fitted_drift
from engine_mount.identification.friction.files import TOPICS, read_recording
from engine_mount.recordings.place import open_run
from engine_mount.recordings.recording import Recording
from engine_mount.recordings.session import recorded_session, session_content
from mount_models.specimen import Specimen
from mount_ros.topics import AIR_GAP, CURRENT_FORCE_TABLE

_SLIDING = 0.5  # of the highest speed: pads slide there (chosen)


@dataclass(frozen=True)
class State:
    """What one recording tells: at `hours` gap and its deviation (m), offset current (A), friction (1).

    `pressed` (m) is by how much the highest clamping force compresses the pads. NaN is unknown.
    """

    name: str
    hours: float
    contact_gap: float
    contact_gap_std: float
    offset_current: float
    pressed: float
    friction: float


@dataclass(frozen=True)
class DriftResult:
    """All states by time, the lines through them, and the travel (m) until the law's range ends."""

    states: list[State]
    gap: Drift
    current: Drift
    friction: Drift | None
    limit: float
    left: float
    left_std: float
    hours_left: float | None


def identify_drift(
    paths: Sequence[Path], specimen: Specimen, hours: Mapping[Path, float] | None = None
) -> DriftResult:
    """Return wear and drift over the recordings; raises `DriftError` and the readers' errors.

    Times are those of `hours` (a counter), else of the sessions' start.
    """
    if len(paths) < FEWEST:
        raise DriftError(
            f'{len(paths)} recording tells no drift; at least {FEWEST} from different times are needed'
        )
    told = hours or {}
    if told and set(told) != set(paths):
        missing = next(path for path in paths if path not in told)
        raise DriftError(f'--hours must be told for all recordings or none; {missing} has none')
    states = sorted((_state(path, specimen, told.get(path)) for path in paths), key=lambda state: state.hours)
    first = states[0].hours
    times = np.array([state.hours - (0.0 if told else first) for state in states])
    states = [State(each.name, float(time), *_rest(each)) for each, time in zip(states, times, strict=True)]
    gap = fitted_drift(
        times, [each.contact_gap for each in states], [each.contact_gap_std for each in states]
    )
    current = fitted_drift(times, [each.offset_current for each in states])
    known = [(each.hours, each.friction) for each in states if math.isfinite(each.friction)]
    friction = None
    if len(known) >= FEWEST and np.ptp([time for time, _ in known]) > 0.0:
        friction = fitted_drift(*np.array(known).T)
    limit = specimen.force_law.gap_low + states[-1].pressed
    left = float(gap.at(times[-1])) - limit
    wears = gap.slope < -2.0 * gap.slope_std
    return DriftResult(
        states, gap, current, friction, limit, left, float(gap.std_at(times[-1])),
        max(left, 0.0) / -gap.slope if wears else None,
    )  # fmt: skip


def figures(result: DriftResult) -> dict[str, Any]:
    """Return the result as plain numbers, for JSON."""

    def line(drift: Drift | None, unit: str) -> dict[str, Any] | None:
        if drift is None:
            return None
        return {
            f'per_hour_{unit}': drift.slope,
            f'per_hour_std_{unit}': _known(drift.slope_std),
            f'mean_{unit}': drift.level,
            'scatter_over_stated': _known(drift.ratio),
        }

    return {
        'recordings': [
            {
                'recording': each.name, 'hours': each.hours, 'contact_gap_m': each.contact_gap,
                'contact_gap_std_m': each.contact_gap_std, 'offset_current_a': each.offset_current,
                'friction': _known(each.friction),
            }
            for each in result.states
        ],
        'contact_gap': line(result.gap, 'm'),
        'offset_current': line(result.current, 'a'),
        'friction': line(result.friction, '1'),
        'least_contact_gap_m': result.limit,
        'remaining_travel_m': result.left,
        'remaining_travel_std_m': result.left_std,
        'remaining_hours': result.hours_left,
    }  # fmt: skip


def _rest(state: State) -> tuple[float, float, float, float, float]:
    return (
        state.contact_gap, state.contact_gap_std, state.offset_current, state.pressed, state.friction
    )  # fmt: skip


def _state(path: Path, specimen: Specimen, hours: float | None) -> State:
    recording = open_run(path)
    if AIR_GAP.name not in recording or not len(recording[AIR_GAP.name]):
        raise DriftError(
            f'{path} holds no air_gap; give recordings of drives in which the initialisation ended well'
        )
    gaps = recording[AIR_GAP.name]
    numbers = {name: float(gaps[name][-1]) for name in ('contact_gap', 'contact_gap_std', 'offset_current')}
    for name, value in numbers.items():
        if not math.isfinite(value) or value <= 0.0:
            raise DriftError(f'{path}: {name} ({value:g}) must be a number above 0; leave this recording out')
    return State(
        path.name,
        _started(recording, path) if hours is None else hours,
        numbers['contact_gap'],
        numbers['contact_gap_std'],
        numbers['offset_current'],
        _highest_force(recording, path) / specimen.pad_stiffness,
        _friction(recording, path),
    )


def _started(recording: Recording, path: Path) -> float:
    """Return when the session began, in hours of the clock."""
    try:
        started = session_content(recorded_session(recording))['started']
        return datetime.fromisoformat(started).timestamp() / 3600.0
    except (KeyError, TypeError, ValueError) as error:
        raise DriftError(
            f'{path} does not tell when it began ({error}); give the hours of all by --hours FILE=H'
        ) from None


def _highest_force(recording: Recording, path: Path) -> float:
    if CURRENT_FORCE_TABLE.name not in recording or not len(recording[CURRENT_FORCE_TABLE.name]):
        raise DriftError(f'{path} holds no current_force_table; give recordings of whole drives')
    return float(max(recording[CURRENT_FORCE_TABLE.name].message(-1).data))


def _friction(recording: Recording, path: Path) -> float:
    """Return the median of |F_F| / F_N while sliding, where a rack's load cells are recorded; else NaN."""
    if not all(topic in recording and len(recording[topic]) for topic, _ in TOPICS.values()):
        return math.nan
    rack = read_recording(path / 'recording' if (path / 'recording').is_dir() else path)
    speed = np.abs(np.gradient(rack.displacement, rack.dt))
    sliding = speed > _SLIDING * np.percentile(speed, 99)
    return float(np.median(np.abs(rack.force[sliding]) / rack.normal_force[sliding, 0]))


def _known(value: float) -> float | None:
    return value if math.isfinite(value) else None
