"""Whatever a reader of others stumbles over in a broken file, as one sentence."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from engine_mount.signals.signal import SignalError

_LONGEST = 200  # letters of a library's own words, chosen


@contextmanager
def reading(
    path: Path, kind: str, remedy: str = 'is it cut off, or another format? Export it again'
) -> Iterator[None]:
    """Turn every error of a library that reads `path` as a `kind` of file into a `SignalError`.

    Libraries raise whatever a damaged file makes of their own assumptions (KeyError, struct.error,
    MemoryError, ...), so that no list of classes would be complete. Our own refusals pass as they are.
    """
    try:
        yield
    except (SignalError, ImportError):
        raise
    except FileNotFoundError:
        raise SignalError(f'{path} does not exist; give an existing file') from None
    except PermissionError:
        raise SignalError(f'{path} may not be read by you; change its permissions') from None
    except Exception as error:
        words = ' '.join(f'{type(error).__name__}: {error}'.split())[:_LONGEST]
        raise SignalError(f'{path} is no readable {kind} ({words}); {remedy}') from error
