"""Parameters of the recorder."""

from typing import Annotated, NamedTuple

from mount_models.quantity import ParameterError, Quantity
from mount_models.sampling import SAMPLE_RATE, SampleRate
from mount_recorder.automatic_marks import MarkKind

_PETABYTE = 10**15
LEAST_SPLIT = 1_000_000  # bytes, chosen
_ALL_KINDS = ', '.join(kind.value for kind in MarkKind)


class RecorderParameters(NamedTuple):
    """How often samples come, how a recording is divided, and when it ends."""

    sample_rate: SampleRate = SAMPLE_RATE
    shadow: Annotated[
        bool, Quantity('truth', 'record the topics of electronics that compute the law themselves, too')
    ] = False
    on_full: Annotated[
        str, Quantity('word', 'what a full disk means for the run: stop (an error) or continue')
    ] = 'stop'
    split_size: Annotated[int, Quantity('B', 'largest file, at least 1 MB; 0: no limit', 0, _PETABYTE)] = 0
    free_reserve: Annotated[
        int, Quantity('B', 'free disk space below which the recording is closed', 0, _PETABYTE)
    ] = 200_000_000
    automatic_marks: Annotated[
        str, Quantity('words', 'which events are marked without being asked; empty: none')
    ] = _ALL_KINDS
    mark_text: Annotated[str, Quantity('text', 'text of the marks that the service sets')] = ''


def check_split(size: int) -> None:
    """Refuse a split size (bytes) below which a file is mostly head and end; raises `ParameterError`."""
    if 0 < size < LEAST_SPLIT:
        raise ParameterError(f'split_size ({size} bytes) must be at least {LEAST_SPLIT} bytes, or 0 for none')
