"""One recording, or file of others, as rows of a catalogue."""

from pathlib import Path

from engine_mount.fleet.catalogue.columns import DRIVE, REPLAY
from engine_mount.fleet.catalogue.places import Place
from engine_mount.fleet.catalogue.rows import Rows, named, rows_of, unreadable
from engine_mount.fleet.foreign import NOTHING_SAID, Said, own_recording
from engine_mount.recordings.recording import ReadingError
from engine_mount.signals.sources.source import StoreAwayError
from engine_mount.signals.sources.stores import local_copy


def read_place(place: Place, said: Said = NOTHING_SAID) -> Rows:
    """Return the rows of what lies at `place`; never raises for what is wrong with it.

    `said` is what is said of files of others. What could not be fetched has no fingerprint, so that it is
    tried again next time; what depends on `said` has its mark in the fingerprint. Raises `StoreAwayError`
    where the store does not answer.
    """
    try:
        with local_copy(place.uri) as path:
            rows = rows_at(path, place, said)
    except StoreAwayError:
        raise
    except OSError as error:
        return unreadable(place, str(error), fingerprint='')
    for row in rows.recordings:
        row['fingerprint'] = fingerprint_of(place, row['kind'], said.mark)
    return rows


def rows_at(path: Path, place: Place, said: Said = NOTHING_SAID) -> Rows:
    """Return the rows of the recording, or file of others, at `path`, a copy of what lies at `place`."""
    try:
        recording = own_recording(path, said)
    except ReadingError as error:
        return unreadable(place, named(str(error), path, place), place.fingerprint)
    if recording is not None:
        return rows_of(recording, path, place)
    from engine_mount.fleet.catalogue.foreign import foreign_rows  # loads the simulator

    return foreign_rows(path, place, said)


def fingerprint_of(place: Place, kind: str, mark: str) -> str:
    """Return the fingerprint of a row of this `kind`; `mark`: of what is said of files of others."""
    return place.fingerprint if kind in (DRIVE, REPLAY) else place.fingerprint + mark
