"""One recording as rows of a catalogue: whatever is wrong with it is told in its row."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC
from pathlib import Path
from typing import Any

from engine_mount.fleet.catalogue.columns import DRIVE, OTHER, REPLAY, UNREADABLE
from engine_mount.fleet.catalogue.figures import OF_FRICTION, lost_figures, state_figures
from engine_mount.fleet.catalogue.places import Place
from engine_mount.recordings.events import event_time, recorded_events
from engine_mount.recordings.recording import ReadingError, Recording
from engine_mount.recordings.series import SeriesError
from engine_mount.recordings.session import (
    duration_of,
    session_parameters,
    started_of,
    told_session,
    versions_told,
)
from engine_mount.settings.changes import changed_parameters
from engine_mount.settings.chosen import Parameters
from mount_sim.mount_choice import seat_of, simulated_mounts
from mount_sim.plant.mounts import without_friction

Row = dict[str, Any]

_LONGEST = 1000  # characters of a reason, chosen


@dataclass(frozen=True)
class Rows:
    """The rows of one recording, those of `events` in the order of their times."""

    recordings: list[Row] = field(default_factory=list)
    events: list[Row] = field(default_factory=list)


def unreadable(place: Place, reason: str) -> Rows:
    """Return the row of a recording of which nothing can be told."""
    return Rows([{**place_of(place), 'kind': UNREADABLE, 'reason': reason[:_LONGEST], 'mount': ''}])


def rows_of(recording: Recording, path: Path, place: Place) -> Rows:
    """Return the rows of a recording, which lies at `path`, one for each of its mounts."""
    rows = Rows()
    for part in recording.by_mount():
        reasons: list[str] = []
        row = {**place_of(place), 'mount': part.mount, 'messages': recording.message_count}
        content = told_session(part)
        row |= _session_figures(part, content, reasons)
        for figures in _guarded(part, reasons, rows.events, row):
            row |= figures
        if _is_without_friction(session_parameters(content)):
            row |= dict.fromkeys(OF_FRICTION)
        told = reason_of([*recording.warnings, *reasons], path, place)
        rows.recordings.append(row | {'whole': recording.whole, 'reason': told})
    return rows


def place_of(place: Place) -> Row:
    """Return what a row tells of the place of its recording."""
    return {
        'uri': place.uri,
        'recording': place.recording,
        'size_bytes': place.size,
    }


def reason_of(reasons: Sequence[str], path: Path, place: Place) -> str:
    """Return what is wrong with the recording at `path`, each reason once, as its row tells it."""
    return named('; '.join(dict.fromkeys(reasons)), path, place)[:_LONGEST]


def named(text: str, path: Path, place: Place) -> str:
    """Return a sentence with the name of the recording instead of where its local copy lay."""
    return text.replace(str(path), place.recording)


def _session_figures(part: Recording, content: Mapping[str, Any], reasons: list[str]) -> Row:
    parameters = session_parameters(content)
    started, duration = started_of(content, part), duration_of(content, part)
    versions = versions_told(content)
    row: Row = {
        'kind': REPLAY if 'replay' in content else DRIVE if part.mounts else OTHER,
        'scenario': str(content.get('scenario', '')),
        'mode': str(content.get('mode', '')),
        'started': started.astimezone(UTC).replace(tzinfo=None) if started else None,
        'duration_s': duration,
        'version': versions.get('mount_bringup', ''),
        'versions': json.dumps(versions, sort_keys=True) if versions else '',
    }
    try:
        own = changed_parameters(parameters)
        changed = {f'{node}.{name}': value for node, each in own.items() for name, (value, _) in each.items()}
        row |= {
            'simulated_mount': simulated_mounts(parameters),
            'policy': str(parameters.get('mount_control', {}).get('policy', '')),
            'parameters': json.dumps(changed, sort_keys=True, default=str) if parameters else '',
            'distance_m': _distance(row['scenario'], parameters, duration),
        }
    except (ValueError, TypeError, AttributeError) as error:
        reasons.append(f'the session cannot be used: {error}')
    return row


def _is_without_friction(parameters: Parameters) -> bool:
    """Return whether control can make no friction in the mount, so that what it did says nothing of it."""
    try:
        return bool(without_friction(seat_of(parameters)))
    except ValueError:
        return False


def _distance(scenario: str, parameters: Parameters, duration: float | None) -> float | None:
    """Return speed times duration (m): of the simulated car on a motorway, whose session tells its speed."""
    speed = parameters.get('mount_sim', {}).get('motorway.speed')
    if scenario != 'motorway' or duration is None or not isinstance(speed, (int, float)):
        return None
    return float(speed) * duration


def _guarded(part: Recording, reasons: list[str], events: list[Row], row: Row) -> Iterator[Row]:
    """Return the figures that can be told; of the others the reason."""
    if not part.mounts:
        return
    try:
        figures, audits = lost_figures(part)
        yield figures
        yield state_figures(part, audits)
        events += _events_of(part, row)
    except (ReadingError, SeriesError, ValueError, KeyError, IndexError) as error:
        reasons.append(f'not all could be told: {error}')


def _events_of(part: Recording, row: Row) -> list[Row]:
    axis = part.time_axis
    named = {name: row[name] for name in ('uri', 'recording', 'mount')}
    found = sorted(recorded_events(part), key=lambda event: (event.stamp, event.log_time, event.kind))
    return [
        {
            **named,
            'time_s': event_time(event, axis),
            'stamp_ns': event.stamp,
            'kind': event.kind,
            'text': event.text,
        }
        for event in found
    ]
