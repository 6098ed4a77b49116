"""A catalogue: what each of many recordings is and holds, whatever is wrong with it; brought up to date."""

import contextlib
import json
import math
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from datetime import UTC
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from engine_mount.drives.inputs.input import has
from engine_mount.fleet.job import Row, Rows, TableJob
from engine_mount.fleet.places import Place, places
from engine_mount.recordings.answers import peak_current
from engine_mount.recordings.audit import audit, control_spans
from engine_mount.recordings.events import event_time, recorded_events, switching_places
from engine_mount.recordings.losses import losses
from engine_mount.recordings.recording import ReadingError, Recording, open_run
from engine_mount.recordings.series import Series, SeriesError
from engine_mount.recordings.session import (
    duration_of,
    recorded_sample_rate,
    session_parameters,
    started_of,
    told_session,
    versions_told,
)
from engine_mount.recordings.times import each_once, misdated
from engine_mount.settings.chosen import changed_parameters
from mount_ros.topics import AIR_GAP, COIL_TEMPERATURE, CONTROL_TRACE, CURRENT_SETPOINT, DISPLACEMENT
from mount_sim.plant.mounts import seat_of, simulated_mounts, without_friction

if TYPE_CHECKING:
    import pyarrow

DRIVE, REPLAY, OTHER, UNREADABLE = 'drive', 'replay', 'other', 'unreadable'
"""Kinds of a recording; `other` holds no displacement of a mount."""

_LONGEST = 1000  # characters of a reason, chosen
_BLOCK = 1 << 13  # samples whose power is summed together, chosen
_TRACE = ('damping_active', 'velocity', 'friction_coefficient', 'normal_force')
_OF_FRICTION = ('switched_on', 'damping_s', 'peak_current_a', 'pad_energy_j')
"""What control did to the friction: nothing in a mount without pads or with an open coil driver."""


class Indexed(NamedTuple):
    """The tables of a catalogue, and how many recordings were read, unchanged and unreadable."""

    recordings: 'pyarrow.Table'
    events: 'pyarrow.Table'
    read: int
    unchanged: int
    unreadable: int


def index(
    uris: Iterable[str | os.PathLike[str]],
    out: str | os.PathLike[str],
    progress: Callable[[int, int], None] = lambda done, of: None,
    **options: Any,
) -> Indexed:
    """Bring the catalogue in the folder `out` up to date with the recordings at and below `uris`.

    Recordings whose files have the same sizes, times and etags are not read again; those that are no more
    below `uris` leave the catalogue. An interrupted call goes on where it stopped. `options` are those of
    `run_tasks`. Rows depend on the recordings alone. Raises `SourceError`, `SchedulerLostError`, `OrderError`
    and `WritingError`.
    """
    found = places(os.fspath(uri) for uri in uris)
    job = TableJob(Path(out), ('events', 'recordings'), 'uri', rows_of, _unreadable)
    done = job.run(list(found.values()), progress, **options)
    kinds = [rows['recordings'][0]['kind'] for rows, _ in done.answers]
    return Indexed(
        **done.tables,
        read=len(done.read),
        unchanged=len(found) - len(done.read),
        unreadable=kinds.count(UNREADABLE),
    )


def rows_of(path: Path, place: Place) -> Rows:
    """Return the rows of the recording at `path`, a copy of what lies at `place`, one for each of its mounts.

    What cannot be told has its reason there, with the name of the recording instead of where the copy lay.
    """
    recordings: list[Row] = []
    events: list[Row] = []
    try:
        recording = open_run(path)
    except ReadingError as error:
        return _unreadable(place, _named([str(error)], path, place), place.fingerprint)
    for part in recording.by_mount():
        reasons: list[str] = []
        row = {**place._asdict(), 'mount': part.mount, 'messages': recording.message_count}
        content = told_session(part)
        row |= _session_figures(part, content, reasons)
        if part.mounts:
            try:
                audits = audit(part)
                row |= _lost_figures(part, audits)
                row |= _state_figures(part, audits)
                events += _events(part, row)
            except (ValueError, LookupError) as error:
                reasons.append(f'not all could be told: {error}')
        with contextlib.suppress(ValueError):
            if without_friction(seat_of(session_parameters(content))):
                row |= dict.fromkeys(_OF_FRICTION)
        reason = _named([*recording.warnings, *reasons], path, place)
        recordings.append(row | {'whole': recording.whole, 'reason': reason})
    return {'recordings': recordings, 'events': events}


def _unreadable(place: Place, reason: str, fingerprint: str = '') -> Rows:
    """Return the row of a recording of which nothing can be told; without `fingerprint` it is tried again."""
    row = place._replace(fingerprint=fingerprint)._asdict()
    return {'recordings': [row | {'kind': UNREADABLE, 'reason': reason[:_LONGEST], 'mount': ''}]}


def _named(reasons: Sequence[str], path: Path, place: Place) -> str:
    """Return what is wrong with the recording at `path`, each reason once."""
    return '; '.join(dict.fromkeys(reasons)).replace(str(path), place.recording)[:_LONGEST]


def _session_figures(part: Recording, content: Mapping[str, Any], reasons: list[str]) -> Row:
    parameters = session_parameters(content)
    started = started_of(content, part)
    row: Row = {
        'kind': REPLAY if 'replay' in content else DRIVE if part.mounts else OTHER,
        'scenario': str(content.get('scenario', '')),
        'mode': str(content.get('mode', '')),
        'started': started.astimezone(UTC).replace(tzinfo=None).isoformat() if started else None,
        'duration_s': duration_of(content, part),
        'version': versions_told(content).get('mount_bringup', ''),
    }
    try:
        own = changed_parameters(parameters)
        changed = {f'{node}.{name}': value for node, each in own.items() for name, (value, _) in each.items()}
        row |= {
            'simulated_mount': simulated_mounts(parameters),
            'policy': str(parameters.get('mount_control', {}).get('policy', '')),
            'parameters': json.dumps(changed, sort_keys=True, default=str) if parameters else '',
        }
    except (ValueError, TypeError, AttributeError) as error:
        reasons.append(f'the session cannot be used: {error}')
    return row


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
        topic.name for topic in (AIR_GAP, COIL_TEMPERATURE, CONTROL_TRACE, DISPLACEMENT) if has(part, topic)
    }
    figures: Row = {}
    if AIR_GAP.name in there:
        for name, unit in (('rest_gap', 'm'), ('contact_gap', 'm'), ('offset_current', 'a')):
            figures[f'{name}_{unit}'] = float(part[AIR_GAP.name][name][-1])
    if COIL_TEMPERATURE.name in there:
        celsius = part[COIL_TEMPERATURE.name]['temperature']
        known = celsius[np.isfinite(celsius)]
        figures['coil_temperature_degc'] = float(known.max()) if known.size else math.nan
    columns = {CONTROL_TRACE.name: _TRACE, DISPLACEMENT.name: DISPLACEMENT.names}
    part.load_columns({name: names for name, names in columns.items() if name in there})
    if CONTROL_TRACE.name in there:
        figures |= trace_figures(part[CONTROL_TRACE.name], 1.0 / recorded_sample_rate(part))
    if DISPLACEMENT.name in there:
        figures |= displacement_figures(part[DISPLACEMENT.name])
    part.release()
    figures['peak_current_a'] = peak_current(part, control_spans(audits))
    return figures


def _events(part: Recording, row: Row) -> list[Row]:
    place = {name: row[name] for name in ('uri', 'recording', 'mount')}
    return [
        {
            **place,
            'time_s': event_time(event, part.time_axis),
            'stamp_ns': event.stamp,
            'kind': event.kind,
            'text': event.text,
        }
        for event in sorted(recorded_events(part), key=lambda each: (each.stamp, each.log_time, each.kind))
    ]


def displacement_figures(displacement: Series) -> dict[str, Any]:
    """Return peak and rms of a displacement, {} where none is known.

    Samples count in the order of their stamps, of several with the same stamp the first. Those that are
    misdated are left out: between them and the others there is nothing to look at.
    """
    try:
        stamps, values = displacement.stamps, displacement[DISPLACEMENT.names[0]]
    except SeriesError:
        return {}
    wrong = misdated(stamps)
    if wrong.any():
        stamps, values = stamps[~wrong], values[~wrong]
    values = values[each_once(stamps)[1]]
    known = values[np.isfinite(values)]
    if not known.size:
        return {}
    return {'peak_displacement_m': float(np.abs(known).max()), 'rms_displacement_m': float(np.std(known))}


def trace_figures(trace: Series, sample_time: float) -> dict[str, Any]:
    """Return switching, and the work of |mu N v| by which the pads wear, mu N being Eq (9)'s friction.

    {} where the trace does not tell them; `sample_time` in s.
    """
    try:
        active, velocity, coefficient, force = (trace[name] for name in _TRACE)
    except SeriesError:
        return {}
    stamps = trace.stamps
    order = slice(None) if np.all(stamps[1:] >= stamps[:-1]) else np.argsort(stamps, kind='stable')
    on, _ = switching_places((stamps[order] - stamps[order][:1]) / 1e9, active[order])
    blocks = [slice(begin, begin + _BLOCK) for begin in range(0, len(active), _BLOCK)]
    power = [np.nan_to_num(np.abs(coefficient[at] * force[at] * velocity[at])).sum() for at in blocks]
    return {
        'switched_on': len(on),
        'damping_s': sample_time * np.count_nonzero(active > 0.0),
        'pad_energy_j': sample_time * math.fsum(power),
    }
