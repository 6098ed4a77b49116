"""Opens recordings: those of this project and genuine rosbag2 bags, whole or in part."""

import contextlib
import copy
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from engine_mount.recordings.collector import RECEIVED, SENT, STAMPS, Collector
from engine_mount.recordings.definitions import Definition
from engine_mount.recordings.metadata import (
    ZERO_KEY,
    BagInformation,
    MetadataError,
    TopicInformation,
    origin,
    read_metadata,
)
from engine_mount.recordings.pieces import (
    Declared,
    Pieces,
    declared_topics,
    find_pieces,
    open_piece,
    repeated_topics,
)
from engine_mount.recordings.series import Payloads, Series, SeriesError, TopicTimes
from engine_mount.recordings.stored import HEAD, StorageError, StoredFile, StoredMessages
from engine_mount.recordings.time_axis import TimeAxis, anchors
from engine_mount.recordings.times import NO_TIMES, Times, shared
from mount_recorder.metadata import METADATA_NAME
from mount_recorder.topic_groups import registered_topic
from mount_ros.topics import CURRENT_SETPOINT, DISPLACEMENT


class ReadingError(ValueError):
    """A recording, or a topic of it, cannot be read; the text gives the reason."""


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
        try:
            pieces = find_pieces(path)
        except StorageError as error:
            raise ReadingError(str(error)) from None
        self.warnings += pieces.warnings
        self.information: BagInformation | None = pieces.information
        self.files: list[StoredFile] = self._open(pieces)
        self._complete = pieces.complete and len(self.files) == len(pieces.paths)
        if self.information is None:
            self._read_embedded_description()
        self._declared: dict[str, Declared] = declared_topics(self.files, self.information)
        self.topics: dict[str, TopicInformation] = {
            name: declared.information for name, declared in self._declared.items()
        }
        self.missing: dict[str, int] = {}
        """How many messages of a topic are known to be missing."""
        self._counts_agree = False
        self.described = pieces.information is not None and len(pieces.information.files) >= len(self.files)
        """Whether `metadata.yaml` covers all files."""
        if self.described:
            self._compare_counts()
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
        others = tuple(f'/{other}/' for other in self.mounts if other != mount)
        part = copy.copy(self)
        part.mount = mount
        part.topics = {name: topic for name, topic in self.topics.items() if not name.startswith(others)}
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
    def proven(self) -> bool:
        """Whether no file is missing and checksums vouch for the account that each gives of itself."""
        return self._complete and all(file.proven for file in self.files)

    @property
    def lost_beside(self) -> list[str]:
        """The names of attachments and metadata that are known to be lost."""
        return [name for file in self.files for name in file.lost_beside]

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

    @property
    def time_axis(self) -> TimeAxis:
        """The time axis shown to users, read once: where `times` were read before, without messages."""
        if self._time_axis is None:
            self._time_axis = self._find_axis()
        return self._time_axis

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
        wanted = {self.resolve(topic): set(names) for topic, names in columns.items()}
        for name, series in self._series.items():
            if name in wanted:
                wanted[name] -= wanted[name] if series.loaded else series.columns.keys()
        known: list[Times] = []
        collected = self._collect(
            {name: {RECEIVED, STAMPS, *names} for name, names in wanted.items() if names}
        )
        for name, collector in collected.items():
            found = collector.columns
            received, stamps = found.pop(RECEIVED, NO_TIMES), found.pop(STAMPS, None)
            series = self._series.setdefault(name, self._make_series(name, partial(self._read_one, name)))
            series.add_columns(found, received, None if stamps is None else shared(stamps, known))

    def release(self) -> None:
        """Forget what was read of the topics: it is read again where it is needed."""
        self._series = {}

    def parts(self, names: Iterable[str], size: int = 0) -> Iterator[Series]:
        """Yield the messages of topics in the order of the files, at most `size` (0: any number) at a time.

        Only these are in memory. Raises `ReadingError`.
        """
        counts = {self.resolve(name): 0 for name in names}
        for name, block in self._blocks(list(counts)) if counts else ():
            counts[name] += len(block)
            for begin in range(0, len(block), size or len(block)):
                part = block.at(slice(begin, begin + size if size else None))
                yield self._make_series(name, (Payloads([part.payloads()]), part.heads))
        for name, count in counts.items():
            self._note_damage(name, count)

    def axis_from(self, stamps: Times, received: Times) -> TimeAxis:
        """Return the time axis by these samples of its topic alone, at least one (ns)."""
        zeros = [step.get(ZERO_KEY) for step in origin(self.information)]
        return TimeAxis(stamps, received, [zero for zero in zeros if isinstance(zero, int)])

    def latched(self, name: str) -> Any:
        """Return the last message of a topic, deserialised; raises `ReadingError` if there is none."""
        series = self[name]
        if not len(series):
            raise ReadingError(f'{series.topic} has no message in {self.path}')
        return series.message(len(series) - 1)

    def times(self) -> dict[str, TopicTimes]:
        """Return the times of all topics: one pass through the files, no message is kept.

        Those of sending are kept of setpoints, those of arrival also of the topic of the time axis.
        """
        anchor = next(iter(anchors(self._types)), '') if self._time_axis is None else ''
        found = self._times_of(self.topics, anchor)
        samples = found.get(anchor)
        if samples and samples.stamps is not None and samples.receive_times is not None:
            self._time_axis = self.axis_from(samples.stamps, samples.receive_times)
        return found

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

    def _open(self, pieces: Pieces) -> list[StoredFile]:
        files, reasons = [], []
        for path in pieces.paths:
            try:
                files.append(open_piece(path))
            except StorageError as error:
                reasons.append(str(error))
        if not files:
            raise ReadingError('; '.join(reasons) or f'{self.path} holds no MCAP file')
        self.warnings += reasons
        for file in files:
            self.warnings += file.warnings
            file.warnings = self.warnings  # what is found later, while a topic is read, comes here too
        return files

    def _read_embedded_description(self) -> None:
        text = self.files[0].metadata.get('rosbag2', {}).get('serialized_metadata')
        if text:
            try:
                self.information = read_metadata(text)
            except MetadataError as error:
                self.warnings.append(f'{self.files[0].path.name}: {error}')

    def _compare_counts(self) -> None:
        """Compare how many messages the description and the files have."""
        assert self.information is not None
        held = {name: declared.stored for name, declared in self._declared.items()}
        described, total = self.information.message_count, sum(held.values())
        self._counts_agree = described == total
        if self._complete and not self._counts_agree:
            self.warnings.append(f'{METADATA_NAME} lists {described} messages, the files hold {total}')
        if not self.proven:
            for topic in self.information.topics:
                if topic.message_count > held.get(topic.name, 0):
                    self.missing[topic.name] = topic.message_count - held.get(topic.name, 0)

    def _check_topics(self) -> None:
        for name, declared in self._declared.items():
            definition, sentence = self._definitions[name] = declared.definition()
            if declared.other_types:
                others = ', '.join(sorted(declared.other_types))
                kept = declared.information.type
                self.warnings.append(f'{name}: messages of {others} are left out; read are those of {kept}')
            if sentence and declared.information.message_count:
                what = 'the installed one is used' if definition else 'only its raw bytes can be read'
                self.warnings.append(f'{name}: {sentence}; {what}')

    # Reading.

    @property
    def _types(self) -> dict[str, str]:
        """The types of the topics that have messages."""
        return {name: topic.type for name, topic in self.topics.items() if topic.message_count}

    def _times_of(self, names: Iterable[str], received: str) -> dict[str, TopicTimes]:
        """Return the times of topics, those of arrival of the topic `received`."""
        wanted: dict[str, set[str]] = {name: {STAMPS} for name in names}
        for name, columns in wanted.items():
            if registered_topic(name, self.topics[name].type) is CURRENT_SETPOINT:
                columns |= {RECEIVED, SENT}
            elif name == received:
                columns.add(RECEIVED)
        times: dict[str, TopicTimes] = {}
        known: list[Times] = []
        for name, collector in self._collect(wanted).items():
            found, obstacle = collector.columns, collector.obstacles.get(STAMPS, '')
            stamps = found.get(STAMPS, None if obstacle else NO_TIMES)
            times[name] = TopicTimes(
                name,
                self.topics[name].type,
                collector.count,
                None if stamps is None else shared(stamps, known),
                found.get(RECEIVED),
                found.get(SENT),
                collector.names,
                obstacle.removeprefix(f'{name}: ').removesuffix('; use receive_times'),
            )
        return times

    def _collect(self, wanted: Mapping[str, Iterable[str]]) -> dict[str, Collector]:
        """Return columns and times of topics, read in one pass."""
        found = {name: Collector(wanted[name], self.topics[name].message_count) for name in wanted}
        for part in self.parts(wanted):
            found[part.topic].add(part)
        return found

    def _find_axis(self) -> TimeAxis:
        for name in anchors(self._types):
            samples: Series | TopicTimes | None = self._series.get(name)
            if samples is None:
                samples = self._times_of([name], name)[name]
            with contextlib.suppress(SeriesError):  # of a foreign topic
                stamps, received = samples.stamps, samples.receive_times
                if stamps is not None and received is not None and len(stamps):
                    return self.axis_from(stamps, received)
        only = np.array([self.time_range[0] if self.time_range else 0])
        return self.axis_from(only, only)

    def _read(self, names: Sequence[str]) -> dict[str, tuple[Payloads, np.ndarray]]:
        """Return bytes and heads of all messages of topics."""
        payloads: dict[str, list] = {name: [] for name in names}
        heads: dict[str, list[np.ndarray]] = {name: [np.empty(0, HEAD)] for name in names}
        for name, block in self._blocks(names) if names else ():
            payloads[name].append(block.payloads())
            heads[name].append(block.heads)
        found = {name: (Payloads(payloads.pop(name)), np.concatenate(heads.pop(name))) for name in names}
        for name, (messages, _) in found.items():
            self._note_damage(name, len(messages))
        return found

    def _read_one(self, name: str) -> tuple[Payloads, np.ndarray]:
        return self._read([name])[name]

    def _make_series(
        self, name: str, messages: tuple[Payloads, np.ndarray] | Callable[[], tuple[Payloads, np.ndarray]]
    ) -> Series:
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
            topics = {name: numbers for name in names if (numbers := self._declared[name].numbers_in(file))}
            heads = set(repeated)
            for block in file.blocks({number for numbers in topics.values() for number in numbers}):
                for name, numbers in topics.items():
                    found = block if len(topics) == 1 else block.of(numbers)
                    if not len(found):
                        continue
                    if name in heads and found.message(0) == last.get(name):
                        found = found.at(slice(1, None))
                    heads.discard(name)
                    if len(found):
                        if name in watched:
                            last[name] = found.message(-1)
                        yield name, found
