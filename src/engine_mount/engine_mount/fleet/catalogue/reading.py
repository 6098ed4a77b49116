"""One recording, or foreign file, as rows of a catalogue."""

from pathlib import Path

from engine_mount.fleet.catalogue.columns import DRIVE, REPLAY
from engine_mount.fleet.catalogue.places import Place
from engine_mount.fleet.catalogue.rows import Rows, named, rows_of, unreadable
from engine_mount.fleet.foreign import NOTHING_SAID, Said, own_recording
from engine_mount.fleet.job import Answer
from engine_mount.recordings.recording import ReadingError
from engine_mount.signals.sources.source import StoreAwayError
from engine_mount.signals.sources.stores import local_copy


def read_place(place: Place, said: Said = NOTHING_SAID) -> Answer:
    """Return the rows of what lies at `place`; never raises for what is wrong with it.

    `said` is what is said of foreign files; the fingerprint of a row that depends on it has its mark. Raises
    `StoreAwayError` where the store does not answer.
    """
    try:
        with local_copy(place.uri) as path:
            rows = rows_at(path, place, said)
    except StoreAwayError:
        raise
    except OSError as error:
        return not_fetched(place, str(error))
    own = rows.recordings[0]['kind'] in (DRIVE, REPLAY)
    return _answer(rows, place.fingerprint if own else place.fingerprint + said.mark)


def not_fetched(place: Place, reason: str) -> Answer:
    """Return the row of a recording that a later run has to try again."""
    return _answer(unreadable(place, reason), '')


def rows_at(path: Path, place: Place, said: Said = NOTHING_SAID) -> Rows:
    """Return the rows of the recording, or foreign file, at `path`, a copy of what lies at `place`."""
    try:
        recording = own_recording(path, said)
    except ReadingError as error:
        return unreadable(place, named(str(error), path, place))
    if recording is not None:
        return rows_of(recording, path, place)
    from engine_mount.fleet.catalogue.foreign import foreign_rows  # loads the simulator

    return foreign_rows(path, place, said)


def _answer(rows: Rows, fingerprint: str) -> Answer:
    recordings = [{**row, 'fingerprint': fingerprint} for row in rows.recordings]
    return Answer({'recordings': recordings, 'events': rows.events}, fingerprint)
