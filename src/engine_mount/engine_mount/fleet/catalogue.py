"""A catalogue: what each of many recordings is and holds, whatever is wrong with it; brought up to date."""

import json
import math
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from datetime import UTC
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from engine_mount.fleet.job import JobProgress, Rows, TableJob
from engine_mount.fleet.motion import TRACE_COLUMNS, displacement_figures, trace_figures
from engine_mount.fleet.places import Place, is_below, places
from engine_mount.fleet.tables import Row
from engine_mount.recordings.answers import peak_current
from engine_mount.recordings.audit import audit, control_spans
from engine_mount.recordings.events import event_time, recorded_events
from engine_mount.recordings.losses import losses
from engine_mount.recordings.place import open_run
from engine_mount.recordings.recording import ReadingError, Recording
from engine_mount.recordings.series import SeriesError
from engine_mount.recordings.session import (
    duration_of,
    recorded_sample_rate,
    session_parameters,
    started_of,
    told_session,
    versions_told,
)
from engine_mount.settings.changes import changed_parameters
from engine_mount.settings.chosen import Parameters
from mount_ros.topics import AIR_GAP, COIL_TEMPERATURE, CONTROL_TRACE, CURRENT_SETPOINT, DISPLACEMENT
from mount_sim.plant.mounts import seat_of, simulated_mounts, without_friction

if TYPE_CHECKING:
    import pyarrow

DRIVE, REPLAY, OTHER, UNREADABLE = 'drive', 'replay', 'other', 'unreadable'
"""Kinds of a recording; `other` holds no displacement of a mount."""

_LONGEST = 1000  # characters of a reason, chosen
_OF_FRICTION = ('switched_on', 'damping_s', 'peak_current_a', 'pad_energy_j')
"""What control did to the friction: nothing in a mount without pads or with an open coil driver."""


class Indexed(NamedTuple):
    """The tables of a catalogue, and how many recordings were read, unchanged, vanished and unreadable."""

    recordings: 'pyarrow.Table'
    events: 'pyarrow.Table'
    read: int
    unchanged: int
    vanished: int
    unreadable: int


def index(
    uris: Iterable[str | os.PathLike[str]],
    out: str | os.PathLike[str],
    progress: Callable[[JobProgress], None] = lambda progress: None,
    **options: Any,
) -> Indexed:
    """Bring the catalogue in the folder `out` up to date with the recordings at and below `uris`.

    Recordings whose files have the same sizes, times and etags are not read again; those that are no more
    below `uris` leave the catalogue, those that lie elsewhere stay. An interrupted call goes on where it
    stopped. `options` are those of `run_tasks`. Rows depend on the recordings alone. Raises `SourceError`,
    `SchedulerLostError`, `OrderError` and `WritingError`.
    """
    roots = [os.fspath(uri) for uri in uris]
    found = places(roots)
    job = TableJob(Path(out), ('events', 'recordings'), 'uri', rows_of, _unreadable)
    done = job.run(list(found.values()), progress, stays=lambda uri: not is_below(uri, roots), **options)
    kinds = [done.answers[uri].rows['recordings'][0]['kind'] for uri in found]
    return Indexed(
        **done.tables,
        read=len(done.read),
        unchanged=len(found) - len(done.read),
        vanished=done.vanished,
        unreadable=kinds.count(UNREADABLE),
    )


def rows_of(path: Path, place: Place) -> Rows:
    """Return the rows of the recording at `path`, a copy of what lies at `place`, one for each of its mounts.

    What cannot be told has its reason there, with the name of the recording instead of where the copy lay.
    """
    rows: dict[str, list[Row]] = {'recordings': [], 'events': []}
    try:
        recording = open_run(path)
    except ReadingError as error:
        return _unreadable(place, _named([str(error)], path, place), place.fingerprint)
    for part in recording.by_mount():
        reasons: list[str] = []
        row = {**_place(place), 'mount': part.mount, 'messages': recording.message_count}
        content = told_session(part)
        row |= _session_figures(part, content, reasons)
        if part.mounts:
            try:
                audits = audit(part)
                row |= _lost_figures(part, audits)
                row |= _state_figures(part, audits)
                rows['events'] += _events(part, row)
            except (ReadingError, SeriesError, ValueError, KeyError, IndexError) as error:
                reasons.append(f'not all could be told: {error}')
        if _is_without_friction(session_parameters(content)):
            row |= dict.fromkeys(_OF_FRICTION)
        reason = _named([*recording.warnings, *reasons], path, place)
        rows['recordings'].append(row | {'whole': recording.whole, 'reason': reason})
    return rows


def _unreadable(place: Place, reason: str, fingerprint: str = '') -> Rows:
    """Return the row of a recording of which nothing can be told; without `fingerprint` it is tried again."""
    row = {**_place(place), 'kind': UNREADABLE, 'reason': reason[:_LONGEST], 'mount': ''}
    return {'recordings': [row | {'fingerprint': fingerprint}]}


def _place(place: Place) -> Row:
    return {
        'uri': place.uri,
        'recording': place.recording,
        'size_bytes': place.size,
        'fingerprint': place.fingerprint,
    }


def _named(reasons: Sequence[str], path: Path, place: Place) -> str:
    """Return what is wrong with the recording at `path`, each reason once."""
    return '; '.join(dict.fromkeys(reasons)).replace(str(path), place.recording)[:_LONGEST]


def _session_figures(part: Recording, content: Mapping[str, Any], reasons: list[str]) -> Row:
    parameters = session_parameters(content)
    started, duration = started_of(content, part), duration_of(content, part)
    versions = versions_told(content)
    row: Row = {
        'kind': REPLAY if 'replay' in content else DRIVE if part.mounts else OTHER,
        'scenario': str(content.get('scenario', '')),
        'mode': str(content.get('mode', '')),
        'started': started.astimezone(UTC).replace(tzinfo=None).isoformat() if started else None,
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
        }
        speed = parameters.get('mount_sim', {}).get('motorway.speed')  # of the simulated car
        if row['scenario'] == 'motorway' and duration is not None and isinstance(speed, (int, float)):
            row['distance_m'] = float(speed) * duration
    except (ValueError, TypeError, AttributeError) as error:
        reasons.append(f'the session cannot be used: {error}')
    return row


def _is_without_friction(parameters: Parameters) -> bool:
    """Return whether control can make no friction in the mount, so that what it did says nothing of it."""
    try:
        return bool(without_friction(seat_of(parameters)))
    except ValueError:
        return False


def _lost_figures(part: Recording, audits: Mapping[str, Any]) -> Row:
    """Return what a recording lacks and what went wrong in it."""
    found = losses(part, audits)
    first = str(found.faults[0]) if found.faults else ''
    figures = {**found.as_json(), 'faults': len(found.faults), 'first_fault': first}
    for name, entry in audits.items():
        if entry.latency is not None and name.endswith(f'/{CURRENT_SETPOINT.name}'):
            for latency in ('median', 'p99', 'worst'):
                figures[f'latency_{latency}_s'] = getattr(entry.latency, latency)
    return figures


def _state_figures(part: Recording, audits: Mapping[str, Any]) -> Row:
    """Return gaps, temperature, switching, currents and motion, as far as they were recorded."""
    there = {
        topic.name
        for topic in (AIR_GAP, COIL_TEMPERATURE, CONTROL_TRACE, DISPLACEMENT)
        if topic.name in part and part.topics[part.resolve(topic.name)].message_count
    }
    figures: Row = {}
    if AIR_GAP.name in there:
        gap = part[AIR_GAP.name]
        for name, unit in (('rest_gap', 'm'), ('contact_gap', 'm'), ('offset_current', 'a')):
            figures[f'{name}_{unit}'] = float(gap[name][-1])
    if COIL_TEMPERATURE.name in there:
        celsius = part[COIL_TEMPERATURE.name]['temperature']
        known = celsius[np.isfinite(celsius)]
        figures['coil_temperature_degc'] = float(known.max()) if known.size else math.nan
    rate = recorded_sample_rate(part)
    columns = {CONTROL_TRACE.name: TRACE_COLUMNS, DISPLACEMENT.name: DISPLACEMENT.names}
    part.load_columns({name: names for name, names in columns.items() if name in there})
    if CONTROL_TRACE.name in there:
        figures |= trace_figures(part[CONTROL_TRACE.name], 1.0 / rate)
    if DISPLACEMENT.name in there:
        figures |= displacement_figures(part[DISPLACEMENT.name], rate)
    part.release()
    figures['peak_current_a'] = peak_current(part, control_spans(audits))
    return figures


def _events(part: Recording, row: Row) -> list[Row]:
    place = {name: row[name] for name in ('uri', 'recording', 'mount')}
    found = sorted(recorded_events(part), key=lambda event: (event.stamp, event.log_time, event.kind))
    return [
        place
        | {
            'time_s': event_time(event, part.time_axis),
            'stamp_ns': event.stamp,
            'kind': event.kind,
            'text': event.text,
        }
        for event in found
    ]
