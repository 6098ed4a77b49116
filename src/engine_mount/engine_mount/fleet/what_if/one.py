"""One recording of a fleet: fetched, replayed as recorded and with the change, told as rows."""

import functools
import json
import os
import platform
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from engine_mount.fleet.catalogue.places import Place
from engine_mount.fleet.foreign import NOTHING_SAID, Said, as_recording, mapped_in, own_recording
from engine_mount.fleet.job import Answer, Row
from engine_mount.fleet.what_if.columns import ANOTHER_POLICY, DISPLACEMENT, FAILED, REPLAYED, SETPOINTS
from engine_mount.fleet.what_if.compared import (
    Recorded,
    check_concerned,
    compared_setpoints,
    recorded_in,
)
from engine_mount.recordings.place import recording_hash, recording_place
from engine_mount.recordings.recording import open_recording
from engine_mount.settings.chosen import NoEffectError
from engine_mount.signals.sources.source import StoreAwayError
from engine_mount.signals.sources.stores import local_copy
from mount_recorder.versions import versions

Changes = Mapping[str, Mapping[str, Any]]

_OF_THE_MACHINE = ('processor', 'machine', 'c_library')  # no number of a row depends on them


def replay_one(
    asked: Place, changes: Changes, closed_loop: bool = False, said: Said = NOTHING_SAID
) -> Answer:
    """Return the rows of one recording with `changes` {node: {parameter: value}}; nothing is remembered.

    `said` is what is said of foreign files. What cannot be replayed, and what cannot be fetched, is a row
    with its reason. Raises `StoreAwayError` where the store does not answer.
    """
    begin, worker = time.process_time(), f'{platform.node()}/{os.getpid()}'
    common = {'recording': asked.recording, 'size_bytes': asked.size, **told_of(changes, closed_loop)}
    fingerprint = asked.fingerprint
    try:
        with local_copy(asked.uri) as path:
            rows = [common | row for row in _rows(asked, path, changes, closed_loop, said)]
    except StoreAwayError:
        raise
    except OSError as error:
        rows, fingerprint = [failed_row(asked, str(error), changes, closed_loop)], ''
    failed = any(row['outcome'] == FAILED for row in rows)
    return Answer({'result': rows}, fingerprint, failed, time.process_time() - begin, worker)


def failed_row(asked: Place, reason: str, changes: Changes, closed_loop: bool) -> Row:
    """Return the row of a recording that could not be read."""
    return {
        'recording': asked.recording,
        'mount': '',
        'size_bytes': asked.size,
        'reason': reason,
        'outcome': FAILED,
        **told_of(changes, closed_loop),
    }


def told_of(changes: Changes, closed_loop: bool) -> Row:
    """Return the columns that are the same in all rows of an order."""
    replayed_with = {name: told for name, told in versions().items() if name not in _OF_THE_MACHINE}
    return {
        'asked': DISPLACEMENT if closed_loop else SETPOINTS,
        'replayed_with': _json(replayed_with),
        'changes': _json(changes),
    }


def _foreign_row(asked: Place, path: Path, changes: Changes, closed_loop: bool, said: Said) -> Row:
    """Return the row of a file of others, which is made a recording for as long as it is replayed."""
    row: Row = {'sha256': recording_hash(path), 'mount': ''}
    try:
        mapped = mapped_in(path, said)
        row |= mapped.told
        with as_recording(mapped, closed_loop=closed_loop) as place:
            row |= _figures(recorded_in(open_recording(place)), changes, closed_loop) | {'recorded_with': ''}
    except ValueError as error:
        row |= _without_figures(error, asked, path)
    return row


def _rows(asked: Place, path: Path, changes: Changes, closed_loop: bool, said: Said) -> list[Row]:
    try:
        opened = own_recording(path, said)
    except ValueError as error:
        unread = {'sha256': recording_hash(recording_place(path)), 'mount': ''}
        return [unread | _without_figures(error, asked, path)]
    if opened is None:
        return [_foreign_row(asked, path, changes, closed_loop, said)]
    whole = functools.cache(lambda: recording_hash(opened.path))  # once, and where it is needed
    rows = []
    for recording in opened.by_mount():
        row: Row = {'mount': recording.mount}
        try:
            recorded = recorded_in(recording)
            check_concerned(recorded, changes)
            whole()  # the checksum of the file is taken in the same pass
            row |= _figures(recorded, changes, closed_loop)
        except ValueError as error:
            row |= _without_figures(error, asked, path)
        rows.append(row)
    if any(row['outcome'] != ANOTHER_POLICY for row in rows):
        rows = [{'sha256': whole(), **row} for row in rows]
    return rows


def _figures(recorded: Recorded, changes: Changes, closed_loop: bool) -> Row:
    if closed_loop:
        from engine_mount.fleet.what_if.closed_loop import compared_motion  # loads the simulator

        figures = compared_motion(recorded, changes)
    else:
        figures = compared_setpoints(recorded, changes)
    return {'reason': '', 'outcome': REPLAYED, 'recorded_with': recorded.version, **figures}


def _without_figures(error: ValueError, asked: Place, path: Path) -> Row:
    """Return the reason, with the path below what was asked for: the same from whatever store it comes."""
    outcome = ANOTHER_POLICY if isinstance(error, NoEffectError) else FAILED
    return {'reason': str(error).replace(str(path), asked.recording), 'outcome': outcome}


def _json(content: Mapping[str, Any]) -> str:
    return json.dumps(content, sort_keys=True, default=list)
