"""Which recordings an order means: those of a catalogue, and all that lie below URIs or paths."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from engine_mount.fleet.catalogue.places import Place
from engine_mount.fleet.catalogue.places import places as listed
from engine_mount.fleet.columns import TABLES
from engine_mount.signals.extras import required
from engine_mount.signals.sources.uris import shown

_CATALOGUE = '.parquet'


class AskedError(ValueError):
    """An order means no recording, or one name means two; the text says which."""


def recordings_asked(places: Sequence[str], *, others: bool = False) -> list[Place]:
    """Return the recordings of catalogues and below URIs or paths, by their names; raises a `ValueError`.

    With `others` files of others below URIs or paths are meant too, of a catalogue always. A catalogue is a
    table with the columns `uri`, `recording`, `size_bytes` and `fingerprint`, a Parquet file or the folder of
    `engine-mount fleet index`; it tells of files as they were when it was made. Raises `SourceError` where a
    place cannot be listed.
    """
    found: dict[str, Place] = {}
    for place in places:
        table = _catalogue(place)
        below = listed([place], others=others).values() if table is None else _of_catalogue(table)
        for asked in below:
            other = found.setdefault(asked.recording, asked)
            if other.uri != asked.uri:
                raise AskedError(
                    f'{asked.recording} means two recordings: {shown(other.uri)} and {shown(asked.uri)}; '
                    'ask for a folder that holds both'
                )
    if not found:
        raise AskedError(f'no recording at {" or ".join(shown(place) for place in places)}')
    return [found[path] for path in sorted(found)]


def _catalogue(place: str) -> Path | None:
    """Return the table of recordings at `place`, None where that is no catalogue."""
    path = Path(place)
    if path.is_dir():
        path /= f'recordings{_CATALOGUE}'
    return path if path.suffix == _CATALOGUE and path.is_file() else None


def _of_catalogue(table: Path) -> Iterator[Place]:
    parquet: Any = required('pyarrow.parquet', TABLES)
    columns = ['uri', 'recording', 'size_bytes', 'fingerprint']
    rows = parquet.read_table(table, columns=columns).to_pylist()
    for row in {row['recording']: row for row in rows}.values():
        yield Place(row['uri'], row['recording'], row['size_bytes'] or 0, row['fingerprint'] or '')
