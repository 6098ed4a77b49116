"""Recordings in a store that fsspec reaches: listed, and fetched through the local cache."""

from collections.abc import Iterator
from pathlib import Path

from mount_signals.sources.filesystems import filesystem
from mount_signals.sources.source import Entry, SourceError
from mount_signals.sources.uris import name_of, shown


class RemoteStore:
    """S3, Google Cloud Storage, SFTP and HTTP."""

    def entries(self, uri: str) -> Iterator[Entry]:
        """Return every file at or below `uri`, sorted by URI; raises `SourceError`."""
        files, path = filesystem(uri)
        prefix = uri[: len(uri) - len(path)] if uri.endswith(path) else uri.partition('://')[0] + '://'
        for name, told in sorted(files.find(path, detail=True).items()):
            yield Entry(prefix + name, told['size'], float('nan'), str(told.get('ETag', '')))

    def fetch(self, uri: str, scratch: Path) -> Path:
        """Return a whole local copy of the file or folder at `uri`, below `scratch`; raises `SourceError`."""
        files, path = filesystem(uri)
        place = scratch / name_of(uri)
        try:
            files.get(path, str(place), recursive=files.isdir(path))
        except OSError as error:
            raise SourceError(f'{shown(uri)}: {error}') from None
        return place
