"""Recordings without their messages: of an MCAP file only what its summary and its session need is read."""

import contextlib
import mmap
import os
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path, PurePosixPath

from engine_mount.recordings.mcap_records import Summary, gaps, read_summary
from engine_mount.signals.sources.fetching import write_whole
from engine_mount.signals.sources.looking import Found
from engine_mount.signals.sources.patience import Patience, persistent
from engine_mount.signals.sources.reading import stretch
from engine_mount.signals.sources.remote import RemoteStore
from engine_mount.signals.sources.uris import inside, name_of
from mount_recorder.metadata import METADATA_NAME

_TAIL = 64 << 10  # bytes, chosen: most summaries are shorter
_NEAR = 16 << 10  # bytes, chosen: what lies no farther apart is read at once
_BESIDE = (METADATA_NAME, 'summary.json')  # what is listed of a folder beside its MCAP files
_SESSION = 'session'
Stretches = list[tuple[int, int]]


@contextlib.contextmanager
def outlined(uri: str, patience: Patience | None = None) -> Iterator[Path | None]:
    """Give the outline of the recording at `uri` for as long as the block lasts.

    None for one that has to be read whole: a file of it has no sound summary, or is none of MCAP. Raises
    `SourceError`.
    """
    patience = patience or Patience()
    files = RemoteStore(patience).found(uri)
    with tempfile.TemporaryDirectory(prefix='engine_mount_') as folder:
        root = Path(folder, name_of(uri) or 'recording')
        whole = all(_outline(found, root / found.place, patience) for found in files)
        yield root if files and whole else None


def recordings_at(uri: str, patience: Patience | None = None) -> list[str]:
    """Return the URIs of the recordings and runs that a place in a store is or directly holds, sorted.

    Raises `SourceError`.
    """
    files = [found.place for found in RemoteStore(patience).found(uri)]
    if _is_recording(files, PurePosixPath('.')) or files == [PurePosixPath('.')]:
        return [uri]
    inner = {place.parts[0] for place in files if len(place.parts) > 1}
    folders = {name for name in inner if _is_recording(files, PurePosixPath(name))}
    return [inside(uri, name) for name in sorted(folders)]


def _is_recording(files: Sequence[PurePosixPath], folder: PurePosixPath) -> bool:
    """Return whether a folder, or `recording` in it, directly holds files of a recording."""
    return any(
        place.name == METADATA_NAME or place.suffix == '.mcap'
        for place in files
        if place.parent in (folder, folder / 'recording')
    )


def _outline(found: Found, target: Path, patience: Patience) -> bool:
    """Write what is needed of one file; False where it has to be read whole."""
    if target.suffix == '.mcap':
        target.parent.mkdir(parents=True, exist_ok=True)
        return _Outline(found, target, patience).write()
    if '.mcap' in target.suffixes or '.db3' in target.suffixes:
        return False
    if target.name in _BESIDE:
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(_read(found, 0, found.entry.size, patience))
    return True


class _Outline:
    """An MCAP file that is written in stretches, holes between them."""

    def __init__(self, found: Found, target: Path, patience: Patience):
        self._found = found
        self._target = target
        self._patience = patience
        self._size = found.entry.size

    def write(self) -> bool:
        """Write what is needed; False without a sound summary."""
        with self._target.open('w+b') as file:
            os.truncate(file.fileno(), self._size)
            tail = max(0, self._size - _TAIL)
            self._take(file.fileno(), tail, self._size)
            if not self._size:
                return False
            with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
                begin = _summary_begin(data)
                if begin is None:
                    return False
                self._take(file.fileno(), begin, tail)
                summary = read_summary(data)
            if not summary.sound or summary.statistics is None:
                return False
            if summary.statistics.chunk_count != len(summary.chunks) or not summary.chunks:
                return False  # its messages would be looked for in the whole file
            for first, last in _joined(_needed(summary)):
                self._take(file.fileno(), first, min(last, tail))
            # The checksum of all data tells nothing of a file with holes; 0 is none.
            write_whole(file.fileno(), bytes(4), summary.begin - 4)
        return True

    def _take(self, handle: int, begin: int, end: int) -> None:
        if end > begin:
            write_whole(handle, _read(self._found, begin, end, self._patience), begin)


def _read(found: Found, begin: int, end: int, patience: Patience) -> bytes:
    return persistent(found.entry.uri, lambda: stretch(found.entry.uri, begin, end), patience)


def _summary_begin(data: mmap.mmap) -> int | None:
    """Return where the footer says that the summary begins, None without a footer."""
    footer = data[-37:-8]  # opcode, length, begin of the summary, begin of the offsets, checksum
    if len(footer) < 29 or footer[:9] != b'\x02\x14\0\0\0\0\0\0\0':
        return None
    begin = int.from_bytes(footer[9:17], 'little')
    return begin if 0 < begin < len(data) else None


def _needed(summary: Summary) -> Stretches:
    """Return what stands between the chunks and their indexes, and the chunks that hold a session."""
    sessions = {
        number for number, channel in summary.channels.items() if channel.topic.split('/')[-1] == _SESSION
    }
    needed = gaps(summary.chunks, 0, summary.begin)
    begins = [begin for begin, _ in needed[1:]]  # behind each chunk and its message indexes
    return needed + [
        (chunk.position, behind)
        for chunk, behind in zip(summary.chunks, begins, strict=True)
        if chunk.holds(sessions)
    ]


def _joined(stretches: Stretches) -> Stretches:
    """Return stretches in their order, those near to each other as one."""
    joined: Stretches = []
    for begin, end in sorted(stretches):
        if end <= begin:
            continue
        if joined and begin - joined[-1][1] <= _NEAR:
            joined[-1] = joined[-1][0], max(end, joined[-1][1])
        else:
            joined.append((begin, end))
    return joined
