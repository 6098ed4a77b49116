"""Opens recordings: those of this project and genuine rosbag2 bags, whole or in part."""

import copy
import os
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from engine_mount.recordings.bag.folder import BagFolderError, find_pieces, open_piece
from engine_mount.recordings.bag.metadata import (
    BagInformation,
    MetadataError,
    TopicInformation,
    read_metadata,
)
from engine_mount.recordings.bag.origin import ZERO_KEY, origin
from engine_mount.recordings.bag.piece_topics import (
    Declared,
    declared_topics,
    readable_definition,
    repeated_topics,
)
from engine_mount.recordings.container.stored import HEAD, StorageError, StoredFile, StoredMessages
from engine_mount.recordings.messages.columns import ColumnCollector, TimesCollector, TopicTimes
from engine_mount.recordings.messages.definitions import Definition
from engine_mount.recordings.messages.series import Column, Heads, Payloads, Series, heads_of
from engine_mount.recordings.messages.time_axis import Arrivals, TimeAxis, anchors, axis_of
from engine_mount.recordings.messages.times import Times
from mount_recorder.metadata import METADATA_NAME
from mount_recorder.topic_groups import registered_topic
from mount_ros.topics import CURRENT_SETPOINT, DISPLACEMENT


class ReadingError(ValueError):
    """A recording, or what was asked of it, cannot be read; the text says why."""


def open_recording(path: str | os.PathLike[str]) -> 'Recording':
    """Open a recording: its folder or a single file; raises `ReadingError` if nothing is readable.

    What is missing or damaged but does not prevent reading stands in `Recording.warnings`; more may come
    there when topics are read.
    """
    return Recording(Path(path))


class Recording:
    """The messages of a recording by topic; topics are found by full name or by their last part."""

    def __init__(self, path: Path):
        self.path = path
        self.mount = ''
        """Of which of several mounts these are the topics; empty: of all."""
        self.warnings: list[str] = []
        self.information: BagInformation | None = None
        self.files: list[StoredFile] = self._open()
        self._declared: dict[str, Declared] = declared_topics(self.files, self.information)
        self.topics: dict[str, TopicInformation] = {
            name: declared.information for name, declared in self._declared.items()
        }
        self.missing: dict[str, int] = self._missing()
        self._definitions: dict[str, tuple[Definition | None, str]] = {}
        self._check_topics()
        self._series: dict[str, Series] = {}
        self._time_axis: TimeAxis | None = None

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
        others = [f'/{other}/' for other in self.mounts if other != mount]
        part = copy.copy(self)
        part.mount = mount
        part.topics = {
            name: topic for name, topic in self.topics.items() if not name.startswith(tuple(others))
        }
        part._series, part._time_axis = {}, None
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
        return all(file.whole for file in self.files) or self._counts_agree

    @property
    def described(self) -> bool:
        """Whether `metadata.yaml` tells of all files."""
        information = self.information
        return self._has_description and information is not None and len(information.files) >= len(self.files)

    @property
    def proven(self) -> bool:
        """Whether no file is missing and checksums vouch for what all of them say of themselves."""
        return self._complete and all(file.proven for file in self.files)

    @property
    def lost_beside(self) -> list[str]:
        """The names of attachments and metadata that are known to be lost."""
        return [name for file in self.files for name in file.lost_beside]

    @property
    def time_range(self) -> tuple[int, int] | None:
        """The first and the last receive time in ns, None without messages."""
        ranges = [found for found in (file.time_range() for file in self.files) if found is not None]
        return (min(first for first, _ in ranges), max(last for _, last in ranges)) if ranges else None

    @property
    def short_name(self) -> str:
        """What a person calls it: with the folder of the run where its own is just `recording`."""
        path = self.path.absolute()
        return f'{path.parent.name}/{path.name}' if path.name == 'recording' else path.name

    @property
    def time_axis(self) -> TimeAxis:
        """The time that people are told, read once: where `times` were read before, without messages."""
        if self._time_axis is None:
            self._time_axis = self._axis_of(self._arrivals)
        return self._time_axis

    def __contains__(self, name: str) -> bool:
        return len(self._candidates(name)) == 1

    def __iter__(self) -> Iterator[str]:
        return iter(self.topics)

    def __getitem__(self, name: str) -> Series:
        """Return all messages of a topic; raises `ReadingError` with the known topics."""
        full_name = self.resolve(name)
        if full_name not in self._series:
            self._series |= self._load([full_name])
        return self._series[full_name]

    def load(self, names: Iterable[str]) -> None:
        """Read several topics in one pass through the files, for later use; raises `ReadingError`."""
        wanted = dict.fromkeys(self.resolve(name) for name in names)
        self._series |= self._load([name for name in wanted if not self._is_loaded(name)])

    def load_columns(self, columns: Mapping[str, Iterable[str]]) -> None:
        """Read columns of topics and their stamps in one pass, for later use; raises `ReadingError`.

        What else is wanted of these topics later, such as a message or a column that is not in each of them,
        is read then.
        """
        wanted = {self.resolve(topic): self._unread(self.resolve(topic), columns[topic]) for topic in columns}
        collectors = {
            name: ColumnCollector(partial(self._series_in, name), names, self.topics[name].message_count)
            for name, names in wanted.items()
            if names
        }
        for name, block in self._blocks(list(collectors)) if collectors else ():
            collectors[name].add(block)
        all_stamps: list[Times | None] = []
        for name in wanted:
            if name not in collectors:
                continue
            heads, found, stamps = collectors.pop(name).finish()
            stamps = _shared(stamps, all_stamps)
            all_stamps.append(stamps)
            self._note_damage(name, len(heads.received))
            known = self._series[name].columns if name in self._series else {}
            self._series[name] = self._made(
                name, partial(self._whole, name), heads, columns={**known, **found}, stamps=stamps
            )

    def release(self) -> None:
        """Forget what was read of the topics: it is read again where it is asked for."""
        self._series = {}

    def parts(self, names: Iterable[str], size: int) -> Iterator[Series]:
        """Yield the messages of topics in the order of the files; at most their ends have fewer than `size`.

        In memory are no more than that of each topic. Raises `ReadingError`.
        """
        waiting: dict[str, list[_Copied]] = {self.resolve(name): [] for name in names}
        counts = dict.fromkeys(waiting, 0)
        for name, block in self._blocks(list(waiting)):
            waiting[name].append(_copied(block))
            counts[name] += len(block)
            if sum(len(heads) for heads, _ in waiting[name]) >= size:
                yield self._series_of(name, waiting[name])
                waiting[name] = []
        for name, copied in waiting.items():
            self._note_damage(name, counts[name])
            if copied:
                yield self._series_of(name, copied)

    def axis_from(self, topic: str, first: Arrivals) -> TimeAxis:
        """Return the time axis by the first messages of its topic alone."""
        return self._axis_of({topic: first}.__getitem__)

    def latched(self, name: str) -> Any:
        """Return the last message of a topic, deserialised; raises `ReadingError` if there is none."""
        series = self[name]
        if not len(series):
            raise ReadingError(f'{series.topic} has no message in {self.path}')
        return series.message(len(series) - 1)

    def resolve(self, name: str) -> str:
        """Return the full name of the topic meant by `name`, which may lack its namespace."""
        candidates = self._candidates(name)
        if not candidates:
            raise ReadingError(
                f'{self.path} has no topic {name!r}; it has {", ".join(self.topics) or "none"}'
            )
        if len(candidates) > 1:
            raise ReadingError(f'{name!r} is ambiguous in {self.path}: {", ".join(candidates)}')
        return candidates[0]

    def _candidates(self, name: str) -> list[str]:
        for full_name in (name, f'/{name}'):
            if full_name in self.topics:
                return [full_name]
        return [full_name for full_name in self.topics if full_name.endswith(f'/{name}')]

    # Opening.

    def _open(self) -> list[StoredFile]:
        try:
            found = find_pieces(self.path)
        except BagFolderError as error:
            raise ReadingError(str(error)) from None
        self.information = found.information
        self._has_description = found.information is not None
        self.warnings += found.warnings
        files, reasons = [], []
        for path in found.paths:
            try:
                files.append(open_piece(path))
            except StorageError as error:
                reasons.append(str(error))
        if not files:
            raise ReadingError('; '.join(reasons) or f'{self.path} holds no MCAP file')
        self._complete = found.complete and not reasons
        self.warnings += reasons
        for file in files:
            self.warnings += file.warnings
            file.warnings = self.warnings  # what is found later, while a topic is read, comes here too
        if self.information is None:
            self._read_embedded(files)
        return files

    def _read_embedded(self, files: list[StoredFile]) -> None:
        text = files[0].metadata.get('rosbag2', {}).get('serialized_metadata')
        if text:
            try:
                self.information = read_metadata(text)
            except MetadataError as error:
                self.warnings.append(f'{files[0].path.name}: {error}')

    def _missing(self) -> dict[str, int]:
        """Return how many messages of a topic the description tells of that the files do not hold."""
        information = self.information
        self._counts_agree = False
        if information is None or not self.described:
            return {}
        held = {name: declared.stored for name, declared in self._declared.items()}
        total = sum(held.values())
        self._counts_agree = information.message_count == total
        if self._complete and not self._counts_agree:
            self.warnings.append(
                f'{METADATA_NAME} tells of {information.message_count} messages, the files hold {total}'
            )
        if self.proven:
            return {}
        return {
            topic.name: topic.message_count - held.get(topic.name, 0)
            for topic in information.topics
            if topic.message_count > held.get(topic.name, 0)
        }

    def _check_topics(self) -> None:
        for name, declared in self._declared.items():
            definition, sentence = readable_definition(declared)
            self._definitions[name] = (definition, sentence)
            if declared.other_types:
                others = ', '.join(declared.other_types)
                kept = declared.information.type
                self.warnings.append(f'{name}: messages of {others} are left out; read are those of {kept}')
            if sentence and declared.information.message_count:
                what = 'the installed one is used' if definition else 'only its raw bytes can be read'
                self.warnings.append(f'{name}: {sentence}; {what}')

    # Reading.

    def times(self) -> dict[str, TopicTimes]:
        """Return the times of all topics: one pass through the files, no message is kept.

        Those of sending are kept of setpoints, those of arrival also of what tells the time of the recording.
        """
        anchor = next(iter(anchors(self._types)), '')
        found = self._times_of(self.topics, {anchor} if self._time_axis is None else set())
        if self._time_axis is None:
            self._time_axis = self._axis_of(
                lambda name: found[name] if name == anchor else self._arrivals(name)
            )
        return found

    def _times_of(self, names: Iterable[str], received: Collection[str]) -> dict[str, TopicTimes]:
        types = {name: self.topics[name].type for name in names}
        setpoints = {name for name, kind in types.items() if registered_topic(name, kind) is CURRENT_SETPOINT}
        collectors = {}
        for name in types:
            of_setpoint = {'publish_time', 'log_time'} if name in setpoints else set()
            wanted = of_setpoint | ({'log_time'} if name in received else set())
            series_in = partial(self._series_in, name)
            collectors[name] = TimesCollector(
                series_in, *self._definitions[name], wanted, self.topics[name].message_count
            )
        for name, block in self._blocks(list(types)):
            collectors[name].add(block)
        found: dict[str, TopicTimes] = {}
        for name, kind in types.items():
            one = collectors.pop(name).finish(name, kind)
            self._note_damage(name, one.count)
            found[name] = replace(one, stamps=_shared(one.stamps, [each.stamps for each in found.values()]))
        return found

    @property
    def _types(self) -> dict[str, str]:
        """The types of the topics that have messages."""
        return {name: topic.type for name, topic in self.topics.items() if topic.message_count}

    def _arrivals(self, name: str) -> Arrivals:
        """Return when the samples of a topic were taken and came in."""
        if name not in self._series:
            found = self._times_of([name], [name])[name]
            if found.stamps is not None:
                return found
        return self[name]

    def _axis_of(self, arrivals: Callable[[str], Arrivals]) -> TimeAxis:
        steps = [step.get(ZERO_KEY) for step in origin(self.information)]
        first = self.time_range[0] if self.time_range else 0
        return axis_of(self._types, arrivals, [zero for zero in steps if isinstance(zero, int)], first)

    def _load(self, names: Sequence[str]) -> dict[str, Series]:
        found: dict[str, list[_Copied]] = {name: [] for name in names}
        for name, block in self._blocks(names) if names else ():
            found[name].append(_copied(block))
        for name, copied in found.items():
            self._note_damage(name, sum(len(heads) for heads, _ in copied))
        return {name: self._series_of(name, found.pop(name)) for name in names}

    def _series_of(self, name: str, messages: Sequence['_Copied']) -> Series:
        """Return messages of the topic with this full name as a series."""
        heads = heads_of(np.concatenate([np.empty(0, HEAD), *(heads for heads, _ in messages)]))
        return self._made(name, Payloads([payloads for _, payloads in messages]), heads)

    def _series_in(self, name: str, block: StoredMessages) -> Series:
        return self._series_of(name, [_copied(block)])

    def _numbers(self, file: StoredFile, name: str) -> list[int]:
        """Return by which numbers a file knows the topic with this full name."""
        return self._declared[name].numbers_in(file)

    def _is_loaded(self, name: str) -> bool:
        return name in self._series and self._series[name].loaded

    def _whole(self, name: str) -> Series:
        return self._load([name])[name]

    def _unread(self, name: str, columns: Iterable[str]) -> set[str]:
        """Return which of the columns need a pass through the files: none where all messages are here."""
        known = self._series.get(name)
        if known is None:
            return set(columns)
        return set() if known.loaded else set(columns) - known.columns.keys()

    def _made(
        self,
        name: str,
        payloads: Payloads | Callable[[], Series],
        heads: Heads,
        *,
        columns: Mapping[str, Column] | None = None,
        stamps: Times | None = None,
    ) -> Series:
        definition, sentence = self._definitions[name]
        return Series(
            name,
            self.topics[name].type,
            payloads,
            heads,
            columns=columns,
            stamps=stamps,
            definition=definition,
            obstacle='' if definition else sentence,
            zero=self.time_range[0] if self.time_range else 0,
            units=self.topics[name].units,
        )

    def _note_damage(self, name: str, present: int) -> None:
        expected = self.topics[name].message_count
        if present < expected and self.missing.get(name, 0) < expected - present:
            self.warnings.append(f'{name}: {expected - present} of {expected} messages are lost by damage')
            self.missing[name] = expected - present

    def _blocks(self, names: Sequence[str]) -> Iterator[tuple[str, StoredMessages]]:
        """Yield the messages of topics, without those that a piece repeats from the one before."""
        last: dict[str, tuple[bytes, int]] = {}
        repetitions = repeated_topics(self.files)
        watched = frozenset().union(*repetitions)
        for file, repeated in zip(self.files, repetitions, strict=True):
            topics = {name: np.array(self._numbers(file, name), np.int64) for name in names}
            topics = {name: numbers for name, numbers in topics.items() if numbers.size}
            heads = set(repeated)
            wanted = [int(number) for numbers in topics.values() for number in numbers]
            for block in file.blocks(wanted):
                for name, numbers in topics.items():
                    found = block.of(numbers) if len(topics) > 1 else block
                    if not len(found):
                        continue
                    if name in heads and found.message(0) == last.get(name):
                        found = found.at(slice(1, None))
                    heads.discard(name)
                    if len(found):
                        if name in watched:
                            last[name] = found.message(-1)
                        yield name, found


_Copied = tuple[np.ndarray, np.ndarray | list[bytes]]
"""Heads and bytes of messages, without those of others that were unpacked with them."""


def _shared(stamps: Times | None, known: Iterable[Times | None]) -> Times | None:
    """Return the same array for the topics of the same samples."""
    if stamps is None:
        return None
    return next((each for each in known if each is not None and np.array_equal(each, stamps)), stamps)


def _copied(block: StoredMessages) -> _Copied:
    return block.heads, block.payloads()
