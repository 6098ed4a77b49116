"""Parameters of the recorder."""

from typing import Annotated, NamedTuple

from mount_models.quantity import Quantity
from mount_models.sampling import SAMPLE_RATE, SampleRate
from mount_recorder.automatic_marks import MarkKind
from mount_recorder.bag_writer import SplitRule, checked_rule

_PETABYTE = 10**15
_ALL_KINDS = ', '.join(kind.value for kind in MarkKind)


class RecorderParameters(NamedTuple):
    """How often samples come, how a recording is divided, what sets it off, and when it ends."""

    sample_rate: SampleRate = SAMPLE_RATE
    on_full: Annotated[
        str, Quantity('word', 'what a full disk means for the run: stop (an error) or continue')
    ] = 'stop'
    split_size: Annotated[int, Quantity('B', 'largest file, at least 1 MB; 0: no limit', 0, _PETABYTE)] = 0
    split_duration: Annotated[float, Quantity('s', 'longest file, at least 1 s; 0: no limit', 0.0, 1e6)] = 0.0
    snapshot: Annotated[
        float, Quantity('s', 'record only events, with this much before each; 0: record all', 0.0, 3600.0)
    ] = 0.0
    snapshot_after: Annotated[float, Quantity('s', 'and with this much after it', 0.0, 3600.0)] = 10.0
    snapshot_memory: Annotated[
        int, Quantity('B', 'memory for what may come before an event', 1 << 20, 1 << 36)
    ] = 256 << 20  # 75 s of a full drive with the simulator's truth
    free_reserve: Annotated[
        int, Quantity('B', 'free disk space below which the recording is closed', 0, _PETABYTE)
    ] = 200_000_000
    automatic_marks: Annotated[
        str, Quantity('words', 'which events are marked without being asked; empty: none')
    ] = _ALL_KINDS
    mark_text: Annotated[str, Quantity('text', 'text of the marks that the service sets')] = ''


def split_of(parameters: RecorderParameters) -> SplitRule:
    """Return the limits of a file; raises `ParameterError`."""
    return checked_rule(SplitRule(parameters.split_size, round(1e9 * parameters.split_duration)))
