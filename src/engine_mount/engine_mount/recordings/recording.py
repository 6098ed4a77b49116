"""Opens recordings: those of this project and genuine rosbag2 bags, whole or in part."""

import contextlib
import copy
import hashlib
import os
from collections.abc import Iterable, Iterator, Mapping
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from engine_mount.recordings.mcap_file import McapFile
from engine_mount.recordings.mcap_records import HEAD, ReadingError
from engine_mount.recordings.metadata import (
    ZERO_KEY,
    BagInformation,
    TopicInformation,
    origin,
    read_metadata,
    registered_topic,
)
from engine_mount.recordings.pieces import (
    declared_topics,
    definition_of,
    find_pieces,
    open_piece,
)
from engine_mount.recordings.series import Messages, Payloads, Series, SeriesError
from engine_mount.recordings.times import NO_TIMES, TimeAxis, anchors
from mount_recorder.metadata import METADATA_NAME
from mount_ros.topics import CURRENT_SETPOINT, DISPLACEMENT, JOINT_STATE

# Times among columns: no field has such a name, behind the / is that of the property of a `Series`.
_STAMPS, _RECEIVED, _SENT = '/stamps', '/receive_times', '/publish_times'


def open_recording(path: str | os.PathLike[str]) -> 'Recording':
    """Open a recording: its folder or a single file; raises `ReadingError` if nothing is readable.

    What is missing or damaged but does not prevent reading stands in `Recording.warnings`; more may come
    there when topics are read.
    """
    return Recording(Path(path))


def open_run(path: Path) -> 'Recording':
    """Open the recording at `path` or, for the folder of a run, the one in it; raises `ReadingError`."""
    return open_recording(recording_place(path))


def open_mount(path: Path, mount: str = '', option: str = '--position') -> 'Recording':
    """Open the recording at `path` for one mount, the only one or `mount`; raises `ReadingError`.

    `option` is that of a command by which it is chosen.
    """
    recording = open_run(path)
    if not mount and len(recording.mounts) < 2:
        return recording
    if mount.strip('/') not in recording.mounts:
        what = f'no mount {mount!r}' if mount else 'several mounts'
        known = ', '.join(recording.mounts) or 'none with a name'
        raise ReadingError(f'{path} has {what}; it has {known}: choose one with {option}')
    return recording.of_mount(mount.strip('/'))


def recording_place(path: Path) -> Path:
    """Return the recording in `path` if that is the folder of a run, else `path` itself."""
    inside = path / 'recording'
    return inside if inside.is_dir() else path


def recording_hash(path: Path) -> str:
    """Return the SHA-256 of a file; of a folder that of its MCAP files, in the order of their names.

    Of a folder without any it is that of all its files.
    """
    digest = hashlib.sha256()
    files = [part for part in path.rglob('*') if part.is_file()] if path.is_dir() else [path]
    for part in sorted(part for part in files if part.match('*.mcap*')) or sorted(files):
        with part.open('rb') as stream:
            hashlib.file_digest(stream, lambda: digest)
    return digest.hexdigest()


class Recording:
    """The messages of a recording by topic; topics are found by full name or by their last part."""

    def __init__(self, path: Path):
        self.path = path
        self.mount = ''
        """Of which of several mounts these are the topics; empty: of all."""
        self.files: list[McapFile] = []
        self._series: dict[str, Series] = {}
        reasons, pieces = [], find_pieces(path)
        for place in pieces.paths:
            try:
                self.files.append(open_piece(place))
            except ReadingError as error:
                reasons.append(str(error))
        if not self.files:
            raise ReadingError('; '.join(reasons) or f'{path} holds no MCAP file')
        self.warnings: list[str] = [*pieces.warnings, *reasons]
        for file in self.files:
            self.warnings += file.warnings
            file.warnings = self.warnings  # what is found later, while a topic is read, comes here too
        self._complete = pieces.complete and not reasons
        self.information: BagInformation | None = pieces.information or self._embedded_description()
        listed = self.information.topics if self.information else ()
        self.topics: dict[str, TopicInformation] = declared_topics(self.files, listed)
        self.missing: dict[str, int] = {}
        """How many messages of a topic are known to be missing."""
        self.described_count: int | None = None
        """How many messages `metadata.yaml` lists, if it covers all files."""
        if pieces.information is not None and len(pieces.information.relative_file_paths) >= len(self.files):
            self.described_count = pieces.information.message_count
            if self._complete and self.described_count != self.message_count:
                lists = f'{METADATA_NAME} lists {self.described_count} messages'
                self.warnings.append(f'{lists}, the files hold {self.message_count}')
            for topic in () if self.proven else pieces.information.topics:
                missing = topic.message_count - self.topics[topic.name].message_count
                self.missing |= {topic.name: missing} if missing > 0 else {}
        self._definitions = {name: definition_of(topic) for name, topic in self.topics.items()}
        for name, topic in self.topics.items():
            definition, sentence = self._definitions[name]
            if topic.other_types:
                others = ', '.join(sorted(topic.other_types))
                self.warnings.append(
                    f'{name}: messages of {others} are left out; read are those of {topic.type}'
                )
            if sentence and topic.message_count:
                remedy = 'the installed one is used' if definition else 'only its raw bytes can be read'
                self.warnings.append(f'{name}: {sentence}; {remedy}')

    @property
    def mounts(self) -> list[str]:
        """The namespaces of the mounts, without slashes at their ends: those that have a displacement."""
        ends = [name.removesuffix(DISPLACEMENT.name) for name in self.topics]
        return [end.strip('/') for end, name in zip(ends, self.topics, strict=True) if end != name]

    def by_mount(self) -> Iterator['Recording']:
        """Yield the recording of each mount, or this one alone where there are not several."""
        yield from map(self.of_mount, self.mounts) if len(self.mounts) > 1 else [self]

    def of_mount(self, mount: str) -> 'Recording':
        """Return the same recording with the topics of one of `mounts` and those that belong to none.

        What was read of either is read again for the other; `warnings` are common.
        """
        others = tuple(f'/{other}/' for other in self.mounts if other != mount)
        part = copy.copy(self)
        part.mount = mount
        part.topics = {name: topic for name, topic in self.topics.items() if not name.startswith(others)}
        part._series = {}
        part.__dict__.pop('time_axis', None)
        return part

    @property
    def message_count(self) -> int:
        """How many messages the files hold."""
        return sum(topic.message_count for topic in self.topics.values())

    @property
    def whole(self) -> bool:
        """Whether nothing is known to be missing; damage inside of a topic is known once that was read."""
        if self.missing or not self._complete or any(file.damaged for file in self.files):
            return False
        return all(file.whole for file in self.files) or self.described_count == self.message_count

    @property
    def proven(self) -> bool:
        """Whether no file is missing and checksums vouch for the account that each gives of itself."""
        return self._complete and all(file.proven for file in self.files)

    @property
    def time_range(self) -> tuple[int, int] | None:
        """The first and the last receive time in ns, None without messages."""
        times = [time for file in self.files for time in file.time_range or ()]
        return (min(times), max(times)) if times else None

    @property
    def short_name(self) -> str:
        """What a person calls it: with the folder of the run where its own is just `recording`."""
        path = self.path.absolute()
        return f'{path.parent.name}/{path.name}' if path.name == 'recording' else path.name

    @cached_property
    def time_axis(self) -> TimeAxis:
        """The time axis shown to users."""
        zeros = [zero for step in origin(self.information) if isinstance(zero := step.get(ZERO_KEY), int)]
        for name in anchors({name: topic.type for name, topic in self.topics.items() if topic.message_count}):
            self.load_columns({name: ()})
            with contextlib.suppress(SeriesError):  # of a foreign topic
                series = self[name]
                if len(series.stamps):
                    break
        else:
            return TimeAxis(*[np.array([self.time_range[0] if self.time_range else 0])] * 2, zeros)
        return TimeAxis(series.stamps, series.receive_times, zeros)

    def __contains__(self, name: str) -> bool:
        return len(self._candidates(name)) == 1

    def __iter__(self) -> Iterator[str]:
        return iter(self.topics)

    def __getitem__(self, name: str) -> Series:
        """Return all messages of a topic; raises `ReadingError` with the known topics."""
        full_name = self.resolve(name)
        if full_name not in self._series:
            self.load([full_name])
        return self._series[full_name]

    def load(self, names: Iterable[str]) -> None:
        """Read several topics in one pass through the files, for later use; raises `ReadingError`."""
        wanted = dict.fromkeys(self.resolve(name) for name in names)
        unread = [name for name in wanted if name not in self._series or not self._series[name].loaded]
        self._series |= {name: self._make_series(name, found) for name, found in self._read(unread).items()}

    def load_columns(self, columns: Mapping[str, Iterable[str]]) -> None:
        """Read columns of topics and their stamps in one pass, for later use; raises `ReadingError`.

        What else is wanted of these topics later, such as a message or a column that is not in each of them,
        is read then.
        """
        self._read_columns({topic: (_STAMPS, _RECEIVED, *names) for topic, names in columns.items()})

    def load_times(self) -> None:
        """Read the stamps of all topics in one pass, and of setpoints the other times."""
        wanted = {}
        for name, topic in self.topics.items():
            answers = registered_topic(name, topic.type) is CURRENT_SETPOINT
            wanted[name] = (_STAMPS, _RECEIVED, _SENT) if answers else (_STAMPS,)
        self._read_columns(wanted)

    def release(self) -> None:
        """Forget what was read of the topics: it is read again where it is needed."""
        self._series = {}

    def parts(self, names: Iterable[str], most: int | None = None) -> Iterator[Series]:
        """Yield the messages of topics in the order of the files: of some chunks at a time the first `most`.

        Only these are in memory. Raises `ReadingError`.
        """
        counts = {self.resolve(name): 0 for name in names}
        for file in self.files:
            stored = {name: here for name in counts if (here := self.topics[name].places.get(file))}
            for place, part in file.blocks(list(stored.values())) if stored else ():
                name, first = list(stored)[place], part.at(slice(most))
                counts[name] += len(part)
                yield self._make_series(name, (Payloads([first.payloads()]), first.heads))
        for name, present in counts.items():
            expected = self.topics[name].message_count
            if self.missing.get(name, 0) < expected - present:
                self.warnings.append(
                    f'{name}: {expected - present} of {expected} messages are lost by damage'
                )
                self.missing[name] = expected - present

    def latched(self, name: str) -> Any:
        """Return the last message of a topic, deserialise; raises `ReadingError` if there is none."""
        series = self[name]
        if not len(series):
            raise ReadingError(f'{series.topic} has no message in {self.path}')
        return series.message(len(series) - 1)

    def resolve(self, name: str) -> str:
        """Return the full name of the topic meant by `name`, which may lack its namespace."""
        candidates = self._candidates(name)
        if not candidates:
            known = ', '.join(self.topics) or 'none'
            raise ReadingError(f'{self.path} has no topic {name!r}; it has {known}')
        if len(candidates) > 1:
            raise ReadingError(f'{name!r} is ambiguous in {self.path}: {", ".join(candidates)}')
        return candidates[0]

    def _candidates(self, name: str) -> list[str]:
        for full_name in (name, f'/{name}'):
            if full_name in self.topics:
                return [full_name]
        return [full_name for full_name in self.topics if full_name.endswith(f'/{name}')]

    def _embedded_description(self) -> BagInformation | None:
        text = self.files[0].metadata.get('rosbag2', {}).get('serialized_metadata')
        try:
            return read_metadata(text) if text else None
        except ReadingError as error:
            self.warnings.append(f'{self.files[0].path.name}: {error}')
            return None

    def _read_columns(self, wanted: Mapping[str, Iterable[str]]) -> None:
        """Read columns and times that are not in memory; a column that not every message has is left out."""
        found: dict[str, dict[str, list[np.ndarray]]] = {}
        for topic, names in wanted.items():
            name = self.resolve(topic)
            series = self._series.setdefault(
                name, self._make_series(name, lambda name=name: self._read([name])[name])
            )
            unread = [each for each in names if each.removeprefix('/') not in series.columns | vars(series)]
            if unread and not series.loaded:
                series.count = 0
                found[name] = {column: [] for column in unread}
        for part in self.parts(found):
            series = self._series[part.topic]
            if not series.count and part.type == JOINT_STATE:
                with contextlib.suppress(SeriesError):
                    series.first_names = part.names
            series.count = (series.count or 0) + len(part)
            for column, parts in tuple(found[part.topic].items()):
                try:
                    parts.append(getattr(part, column[1:]) if column[0] == '/' else part[column])
                except SeriesError:
                    del found[part.topic][column]
        for name, columns in found.items():
            for column, parts in columns.items():
                if column[0] == '/':
                    setattr(self._series[name], column[1:], np.concatenate([NO_TIMES, *parts]))
                elif parts:
                    self._series[name].columns[column] = np.concatenate(parts)

    def _read(self, names: Iterable[str]) -> dict[str, Messages]:
        """Return bytes and heads of all messages of topics."""
        found: dict[str, tuple[list, list]] = {name: ([], [np.empty(0, HEAD)]) for name in names}
        for part in self.parts(found):
            found[part.topic][0].append(part.payloads.messages)
            found[part.topic][1].append(part.heads)
        return {name: (Payloads(raw), np.concatenate(heads)) for name, (raw, heads) in found.items()}

    def _make_series(self, name: str, messages: Any) -> Series:
        definition, sentence = self._definitions[name]
        return Series(
            name,
            self.topics[name].type,
            messages,
            definition=definition,
            obstacle='' if definition else sentence,
            zero=self.time_range[0] if self.time_range else 0,
            units=self.topics[name].units,
        )
