"""Reads one file of a bag in sqlite3 storage, rosbag2's own before MCAP.

The source is never touched. What its writer had not yet brought into the database when it ended stands in a
log beside it; with one, a copy is read, in which sqlite puts both together. A file packed as a whole is read
from an unpacked copy.
"""

import shutil
import sqlite3
import tempfile
import weakref
from collections.abc import Collection, Iterator
from pathlib import Path

import numpy as np
from mcap.records import Attachment

from engine_mount.recordings.container.message_compression import plain
from engine_mount.recordings.container.stored import (
    HEAD,
    StorageError,
    StoredMessages,
    StoredTopic,
    stored_messages,
)
from engine_mount.recordings.container.whole_files import COMPRESSED_SUFFIXES, unpack

_AT_ONCE = 1000  # rows
# A column may hold any type, whatever was declared; a name or a text that is no UTF-8 is a `ValueError`.
_UNREADABLE = (sqlite3.Error, ValueError, TypeError, KeyError, OverflowError)
_LOGS = ('-wal', '-journal')  # behind the name of the database


class SqliteFile:
    """Topics and messages of a `.db3` file; storage without checksums."""

    def __init__(self, path: Path):
        self.path = path
        self.topics: dict[int, StoredTopic] = {}
        self.metadata: dict[str, dict[str, str]] = {}
        self.records: list[tuple[str, dict[str, str]]] = []
        self.warnings: list[str] = []
        self.lost_beside: list[str] = []
        self.damaged = False
        self._counts: dict[int, int] = {}
        self._times: tuple[int, int] | None = None
        self._logs = [log for log in _logs_of(path) if log.is_file() and log.stat().st_size]
        if not path.is_file():
            raise StorageError(f'{path} cannot be read: no such file')
        try:
            self._base = self._connected()
            self._read_topics()
        except _UNREADABLE as error:
            raise StorageError(f'{path} is no readable sqlite3 bag: {error}') from None
        if self._logs:
            names = ', '.join(log.name for log in self._logs)
            self.warnings.append(f'{path.name} was not closed by its writer; read with {names}')

    @property
    def whole(self) -> bool:
        """Whether nothing of it is known to be missing: it was closed, and is readable."""
        return not self.damaged and not self._logs

    @property
    def proven(self) -> bool:
        """Whether what it says of itself can be relied upon: a closed database has its own checks."""
        return not self._logs

    def message_counts(self) -> dict[int, int]:
        """Return the number of messages by topic."""
        return dict(self._counts)

    def time_range(self) -> tuple[int, int] | None:
        """Return the earliest and the latest receive time (ns), None for a file without messages."""
        return self._times

    def blocks(self, topics: Collection[int]) -> Iterator[StoredMessages]:
        """Yield the messages of `topics` in the order of their times."""
        marks = ','.join(map(str, sorted(topics)))
        wanted = f'topic_id IN ({marks}) ORDER BY timestamp, id'
        query = f'SELECT topic_id, timestamp, data FROM messages WHERE {wanted}'
        try:
            cursor = self._base.execute(query)
            while rows := cursor.fetchmany(_AT_ONCE):
                yield plain(_messages(rows))
        except _UNREADABLE as error:
            self.damaged = True
            self.warnings.append(f'{self.path.name}: the rest of its messages is not readable ({error})')

    def attachments(self) -> Iterator[Attachment]:
        """Yield nothing: this storage has none."""
        return iter(())

    def _connected(self) -> sqlite3.Connection:
        if self.path.suffix in COMPRESSED_SUFFIXES:
            return self._unpacked()
        if not self._logs:
            return sqlite3.connect(f'{self.path.absolute().as_uri()}?mode=ro&immutable=1', uri=True)
        try:
            folder = self._scratch()
            for file in (self.path, *self._logs):
                shutil.copyfile(file, folder / file.name)
        except OSError as error:
            raise StorageError(
                f'{self.path} was not closed and cannot be copied to be read with its log: '
                f'{error.strerror}; make room in {tempfile.gettempdir()}'
            ) from None
        return sqlite3.connect(folder / self.path.name)

    def _unpacked(self) -> sqlite3.Connection:
        """Return the database of a file that is packed as a whole; it needs the space of the unpacked one."""
        try:
            copy = self._scratch() / self.path.stem
            with self.path.open('rb') as packed, copy.open('wb') as target:
                unpack(packed, target, self.path.suffix)
        except OSError as error:
            raise StorageError(
                f'{self.path} cannot be unpacked: {error.strerror}; make room in {tempfile.gettempdir()}'
            ) from None
        return sqlite3.connect(copy)

    def _scratch(self) -> Path:
        """Return a folder that is removed with this object."""
        folder = Path(tempfile.mkdtemp(prefix='engine_mount_'))
        weakref.finalize(self, shutil.rmtree, folder, ignore_errors=True)
        return folder

    def _read_topics(self) -> None:
        cursor = self._base.execute('SELECT * FROM topics')
        columns = [column[0] for column in cursor.description]
        definitions = self._definitions()
        for row in cursor.fetchall():
            topic = dict(zip(columns, row, strict=True))
            number, type_name = int(topic['id']), str(topic['type'])
            encoding, text = definitions.get(type_name, ('', ''))
            details = {
                'offered_qos_profiles': str(topic.get('offered_qos_profiles') or ''),
                'topic_type_hash': str(topic.get('type_description_hash') or ''),
            }
            self.topics[number] = StoredTopic(
                name=str(topic['name']),
                type=type_name,
                encoding=str(topic['serialization_format']),
                definition=text.encode(),
                definition_encoding=encoding,
                details=details,
            )
        counts = self._base.execute('SELECT topic_id, COUNT(*) FROM messages GROUP BY topic_id')
        self._counts = dict(counts.fetchall())
        first, last = self._base.execute('SELECT MIN(timestamp), MAX(timestamp) FROM messages').fetchone()
        self._times = None if first is None else (first, last)

    def _definitions(self) -> dict[str, tuple[str, str]]:
        """Return {type: (encoding, text)}; older bags have none."""
        query = 'SELECT topic_type, encoding, encoded_message_definition FROM message_definitions'
        try:
            rows = self._base.execute(query).fetchall()
            return {str(kind): (str(encoding), str(text)) for kind, encoding, text in rows}
        except _UNREADABLE:
            return {}


def _logs_of(path: Path) -> list[Path]:
    return [path.with_name(path.name + suffix) for suffix in _LOGS]


def _messages(rows: list[tuple[int, int, bytes]]) -> StoredMessages:
    """Return rows of the database; it tells one time of a message, and no number."""
    heads = np.zeros(len(rows), HEAD)
    heads['topic'], heads['log_time'] = [row[0] for row in rows], [row[1] for row in rows]
    heads['publish_time'] = heads['log_time']
    return stored_messages(heads, [row[2] for row in rows])
