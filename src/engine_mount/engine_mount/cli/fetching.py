"""Recordings that a command is given by URI, brought onto this machine; paths stay what they are."""

from pathlib import Path

from rich.console import Console

from engine_mount.signals.sources.uris import is_uri, shown


def local(recording: str, console: Console) -> Path:
    """Return where a recording lies: a URI is fetched whole, with a bar; raises `SourceError`."""
    if not is_uri(recording):
        return Path(recording)
    from engine_mount.cli.screen import TerminalScreen
    from engine_mount.signals.sources.stores import fetched

    with TerminalScreen(console).bar(f'fetching {shown(recording)}', transient=True) as bar:
        return fetched(recording, lambda done, of: bar(done / of, detail=f'{of / 1e6:.1f} MB'))


def beside(recording: Path) -> Path:
    """Return the folder for what is made of a recording: where it lies, if fetched the current one."""
    if is_fetched(recording):
        return Path.cwd()
    return recording.absolute().parent


def named(recording: Path) -> str:
    """Return what a recording is called to whom asked for it: its path, or the URI that it was fetched by."""
    from engine_mount.signals.sources.stores import uri_of

    return uri_of(recording) or str(recording)


def is_fetched(recording: Path) -> bool:
    """Return whether a path is a copy that was fetched by URI, or lies in one."""
    from engine_mount.signals.sources.stores import uri_of

    return bool(uri_of(recording))
