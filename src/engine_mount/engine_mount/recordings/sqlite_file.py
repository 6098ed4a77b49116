"""Reads one file of a bag in sqlite3 storage, rosbag2's own before MCAP.

The source is never touched. What its writer had not yet brought into the database when it ended stands in a
log beside it; with one, a copy is read, in which sqlite puts both together.
"""

import shutil
import sqlite3
import tempfile
import weakref
from collections.abc import Collection, Iterator
from pathlib import Path

import numpy as np

from engine_mount.recordings.stored import (
    HEAD,
    StorageError,
    StoredFile,
    StoredMessages,
    StoredTopic,
    stored_messages,
)
from engine_mount.recordings.unpacking import plain

_AT_ONCE = 5000  # rows, chosen
# A column may hold any type, whatever was declared; a name or a text that is no UTF-8 is a `ValueError`.
_UNREADABLE = (sqlite3.Error, ValueError, TypeError, KeyError, OverflowError)
_LOGS = ('-wal', '-journal')  # behind the name of the database


class SqliteFile(StoredFile):
    """Topics and messages of a `.db3` file; storage without checksums."""

    def __init__(self, path: Path):
        super().__init__(path)
        self.damaged = False
        logs = (path.with_name(path.name + suffix) for suffix in _LOGS)
        self._logs = [log for log in logs if log.is_file() and log.stat().st_size]
        if not path.is_file():
            raise StorageError(f'{path} cannot be read: no such file')
        try:
            self._base = self._connect()
            self._read_topics()
        except _UNREADABLE as error:
            raise StorageError(f'{path} is no readable sqlite3 bag: {error}') from None
        self.proven = not self._logs  # a closed database has its own checks
        if self._logs:
            names = ', '.join(log.name for log in self._logs)
            self.warnings.append(f'{path.name} was not closed by its writer; read with {names}')

    @property
    def whole(self) -> bool:
        """Whether nothing of it is known to be missing: it was closed, and is readable."""
        return self.proven and not self.damaged

    def blocks(self, topics: Collection[int]) -> Iterator[StoredMessages]:
        wanted = f'topic_id IN ({",".join(map(str, topics))}) ORDER BY timestamp, id'
        try:
            cursor = self._base.execute(f'SELECT topic_id, timestamp, data FROM messages WHERE {wanted}')
            while rows := cursor.fetchmany(_AT_ONCE):
                numbers, times, raws = zip(*rows, strict=True)
                heads = np.zeros(len(rows), HEAD)  # it has one time of a message, and no number
                heads['topic'], heads['log_time'], heads['publish_time'] = numbers, times, times
                yield plain(stored_messages(heads, list(raws)))
        except _UNREADABLE as error:
            self.damaged = True
            self.warnings.append(f'{self.path.name}: the rest of its messages is not readable ({error})')

    def _connect(self) -> sqlite3.Connection:
        if not self._logs:
            return sqlite3.connect(f'{self.path.absolute().as_uri()}?mode=ro&immutable=1', uri=True)
        folder = Path(tempfile.mkdtemp(prefix='engine_mount_'))
        weakref.finalize(self, shutil.rmtree, folder, ignore_errors=True)
        try:
            for file in (self.path, *self._logs):
                shutil.copyfile(file, folder / file.name)
        except OSError as error:
            raise StorageError(
                f'{self.path} cannot be copied to be read: {error.strerror}; '
                f'make room in {tempfile.gettempdir()}'
            ) from None
        return sqlite3.connect(folder / self.path.name)

    def _read_topics(self) -> None:
        cursor = self._base.execute('SELECT * FROM topics')
        columns = [column[0] for column in cursor.description]
        definitions = self._definitions()
        for row in cursor.fetchall():
            topic = dict(zip(columns, row, strict=True))
            encoding, text = definitions.get(str(topic['type']), ('', ''))
            self.topics[int(topic['id'])] = StoredTopic(
                name=str(topic['name']),
                type=str(topic['type']),
                encoding=str(topic['serialization_format']),
                definition=text.encode(),
                definition_encoding=encoding,
                details={
                    'offered_qos_profiles': str(topic.get('offered_qos_profiles') or ''),
                    'topic_type_hash': str(topic.get('type_description_hash') or ''),
                },
            )
        counts = self._base.execute('SELECT topic_id, COUNT(*) FROM messages GROUP BY topic_id')
        self.message_counts = dict(counts.fetchall())
        times = "SELECT MIN(timestamp), MAX(timestamp) FROM messages WHERE typeof(timestamp) = 'integer'"
        first, last = self._base.execute(times).fetchone()
        self.time_range = None if first is None else (first, last)

    def _definitions(self) -> dict[str, tuple[str, str]]:
        """Return {type: (encoding, text)}; older bags have none."""
        query = 'SELECT topic_type, encoding, encoded_message_definition FROM message_definitions'
        try:
            rows = self._base.execute(query).fetchall()
        except sqlite3.Error:
            return {}
        return {str(kind): (str(encoding), str(text)) for kind, encoding, text in rows}
