"""Recordings that a command is given by URI, brought onto this machine; paths stay what they are."""

from pathlib import Path
from typing import TYPE_CHECKING

from engine_mount.signals.sources.uris import is_uri, shown

if TYPE_CHECKING:
    from engine_mount.cli.screen import TerminalScreen


def local(recording: str, screen: 'TerminalScreen') -> Path:
    """Return where a recording lies: a URI is fetched whole, with a bar; raises `SourceError`."""
    if not is_uri(recording):
        return Path(recording)
    from engine_mount.signals.sources.stores import fetched

    with screen.bar(f'fetching {shown(recording)}', transient=True) as bar:
        return fetched(recording, lambda done, of: bar(done / of, detail=f'{of / 1e6:.1f} MB'))


def beside(recording: Path, ending: str) -> Path:
    """Return the place of what is made of a recording: beside it; of a fetched one in the current folder."""
    whole = recording.absolute()
    name = whole.name if whole.is_dir() else whole.stem
    return (Path.cwd() if is_fetched(recording) else whole.parent) / (name + ending)


def named(recording: Path) -> str:
    """Return the name of a recording for its user: its path, or the URI that it was fetched by."""
    from engine_mount.signals.sources.stores import uri_of

    return uri_of(recording) or str(recording)


def is_fetched(recording: Path) -> bool:
    """Return whether a path is a copy that was fetched by URI, or lies in one."""
    from engine_mount.signals.sources.stores import uri_of

    return bool(uri_of(recording))
