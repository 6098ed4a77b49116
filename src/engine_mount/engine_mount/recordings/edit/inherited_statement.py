"""What recorders said of their losses, carried on into recordings that are made of others.

Each original recording is a source of its own, told apart by what its recorder said and when it was made. So
pieces of one recording that are put together again count its losses once, those of different ones add up.
"""

import hashlib
from collections.abc import Iterable, Mapping

import yaml

from engine_mount.recordings.metadata import read_statement
from engine_mount.recordings.recording import Recording
from mount_models.plain_yaml import plain_yaml
from mount_recorder.losses import RECORDER_RECORD, Reception, loss_statement

SOURCES = 'sources'  # key in the record of the recorder

Sources = dict[str, dict[str, Reception]]
"""{source: {topic: what its recorder received and lost, and what could not be read of it later}}."""


def sources_of(recording: Recording, read: Mapping[str, int]) -> Sources:
    """Return the sources of a recording of which `read` messages of each topic could be read."""
    record = _record(recording)
    rows, inherited = read_statement(record), _inherited(record)
    unread = {name: max(0, row.get('kept', 0) - read.get(name, 0)) for name, row in rows.items()}
    if inherited:
        own = {name: Reception(overflowed=count) for name, count in unread.items() if count}
    else:
        own = {
            name: Reception(row.get('received', 0), row.get('lost', 0) + unread[name], row.get('missing', 0))
            for name, row in rows.items()
        }
    return {**inherited, _identity(recording, record): own} if own else inherited


def united(sources: Iterable[Sources]) -> Sources:
    """Return all sources, each once."""
    return {identity: topics for each in sources for identity, topics in each.items()}


def inherited_statement(sources: Sources, kept: Mapping[str, int]) -> dict[str, str]:
    """Return the recorder's record of a recording made of `sources` that holds `kept` messages by topic."""
    total: dict[str, Reception] = {}
    for topics in sources.values():
        for name, reception in topics.items():
            entry = total.setdefault(name, Reception())
            entry.received += reception.received
            entry.overflowed += reception.overflowed
            entry.missing += reception.missing
    rows = {
        identity: {name: [entry.received, entry.overflowed, entry.missing] for name, entry in topics.items()}
        for identity, topics in sources.items()
    }
    kept_here = {name: kept.get(name, 0) for name in total}
    return {
        **loss_statement(total, kept_here, excerpt=True),
        SOURCES: yaml.safe_dump(rows, sort_keys=False),
    }


def _record(recording: Recording) -> Mapping[str, str]:
    records = [file.metadata[RECORDER_RECORD] for file in recording.files if RECORDER_RECORD in file.metadata]
    return records[-1] if records else {}


def _inherited(record: Mapping[str, str]) -> Sources:
    try:
        rows = plain_yaml(record[SOURCES])
        return {
            str(identity): {str(name): Reception(*map(int, counts)) for name, counts in topics.items()}
            for identity, topics in rows.items()
        }
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError):
        return {}


def _identity(recording: Recording, record: Mapping[str, str]) -> str:
    text = f'{record.get("topics")} {recording.time_range}'
    return hashlib.sha256(text.encode()).hexdigest()[:16]
