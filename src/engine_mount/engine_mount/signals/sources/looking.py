"""What a store says of a file or folder, without its content."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from email.utils import parsedate_to_datetime
from math import nan
from pathlib import PurePosixPath
from typing import Any

from engine_mount.signals.sources.checksums import Digest, of_info, of_s3
from engine_mount.signals.sources.filesystems import filesystem
from engine_mount.signals.sources.reading import count
from engine_mount.signals.sources.source import Entry, SourceError
from engine_mount.signals.sources.uris import inside, scheme_of, shown


@dataclass(frozen=True)
class Found:
    """A file in a store: what is told of it, its place in the folder asked for, and its checksum if any."""

    entry: Entry
    place: PurePosixPath
    digest: Digest | None = None


def look(uri: str) -> Found | None:
    """Return what the store tells of the file at `uri`, None for a folder; raises as the store does."""
    files, path = filesystem(uri)
    count(0, 1)
    if scheme_of(uri) == 's3':
        return _look_at_object(uri, files, path)
    info = files.info(path)
    if info['type'] == 'directory' or (scheme_of(uri) in ('http', 'https') and path.endswith('/')):
        return None
    return _found(uri, info, PurePosixPath('.'))


def look_inside(uri: str) -> list[Found]:
    """Return the files below the folder at `uri`, by URI, no hidden ones; raises as the store does."""
    files, path = filesystem(uri)
    count(0, 1)
    root = path.rstrip('/')
    found, listed = [], files.find(path, detail=True)
    if not listed and not files.isdir(path):
        raise FileNotFoundError(uri)
    for name, info in listed.items():
        if info['type'] == 'link' or info.get('size') is None:  # as SFTP lists links, and HTTP all
            count(0, 1)
            info = files.info(name)
        place = PurePosixPath(name.removeprefix(root).lstrip('/'))
        # A name with `..` is hidden too: it would lead out of the folder.
        if info['type'] != 'directory' and not any(part.startswith('.') for part in place.parts):
            found.append(_found(inside(uri, str(place)), info, place))
    return sorted(found, key=lambda one: one.entry.uri)


def with_digest(found: Found) -> Found:
    """Return a file of a listing with its checksum where only a look at it alone tells that, as in S3.

    Raises `SourceError` where it is another one by now, and whatever the store raises.
    """
    if found.digest is not None or scheme_of(found.entry.uri) != 's3':
        return found
    now = look(found.entry.uri)
    if now is None or not same(now.entry, found.entry):
        raise changed(found.entry.uri)
    return replace(found, digest=now.digest)


def same(one: Entry, other: Entry) -> bool:
    """Return whether two looks saw the same content, as far as the store tells."""
    return mark(one) == mark(other)


def mark(entry: Entry) -> tuple[int, str]:
    """Return what changes with the content: the size, and the store's own mark or else the time."""
    return entry.size, entry.etag or repr(entry.modified)


def changed(uri: str) -> SourceError:
    """Return what is raised of a file or folder that is not what it was a moment ago."""
    return SourceError(f'{shown(uri)} was changed while it was fetched; fetch it once its writer has ended')


def _look_at_object(uri: str, files: Any, path: str) -> Found | None:
    """Return an object of S3: one request tells its size, tag and checksum."""
    bucket, key, version = files.split_path(path)
    if not key:
        return None
    which = {'VersionId': version} if version else {}
    try:
        head = files.call_s3('head_object', Bucket=bucket, Key=key, ChecksumMode='ENABLED', **which)
    except FileNotFoundError:
        return None  # or nothing: the listing tells
    info = {**head, 'size': head['ContentLength']}
    return Found(_entry(uri, info), PurePosixPath('.'), of_s3(head))


def _found(uri: str, info: Mapping[str, Any], place: PurePosixPath) -> Found:
    return Found(_entry(uri, info), place, of_info(info))


def _entry(uri: str, info: Mapping[str, Any]) -> Entry:
    size = info.get('size')
    if size is None:
        raise SourceError(
            f'{shown(uri)}: the server does not tell the size, without which half a file is a whole one'
        )
    tag = str(info.get('ETag') or info.get('etag') or '').strip('"')
    times = (info.get(name) for name in ('LastModified', 'mtime', 'updated', 'Last-Modified', 'created'))
    return Entry(uri, int(size), next(map(_seconds, filter(None, times)), nan), tag)


def _seconds(time: Any) -> float:
    """Return a time as s since 1970, as any store writes it; NaN where it is not understood."""
    if isinstance(time, int | float):
        return float(time)
    if isinstance(time, str):
        try:
            time = datetime.fromisoformat(time) if time[:1].isdigit() else parsedate_to_datetime(time)
        except ValueError:
            return nan
    zoned = time if time.tzinfo else time.replace(tzinfo=UTC)
    return float(zoned.timestamp())
