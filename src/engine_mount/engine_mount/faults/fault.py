"""What a fault of the matrix is: how it comes in, and what the graph must do about it."""

from dataclasses import dataclass
from enum import Enum

from engine_mount.faults.injections import Injection


class Reaction(Enum):
    """What the graph must do; in each case without a traceback and with nothing left behind."""

    TOLERATED = 'damping goes on within 0 .. 3 A, no error is told'
    TOLD = 'it is told; the current stays within 0 .. 3 A'
    SAFE_WHILE = '0 A and told while it lasts, then damping by itself'
    SAFE_UNTIL_INITIALISED = '0 A and told; damping only after a new initialisation'
    REFUSED = 'refused, and nothing changes'
    NOT_STARTED = 'the initialisation refuses with a reason, 0 A'


SAFE = (Reaction.SAFE_WHILE, Reaction.SAFE_UNTIL_INITIALISED)


@dataclass(frozen=True)
class FaultCase:
    """One row of the matrix.

    `words` is a regular expression for the sentence that tells of it. 0 A is looked for in the setpoints on
    the bus, or, where `in_electronics`, in what the electronics follow: where frames do not reach them, and
    where others send frames too. After `silent` faults 0 A is due 50 ms after they began. A graph of its own
    is started with `options` where there are any; `shim`: with processes that the `shim` can change.
    `ends_drive`: the graph does not outlive it. `for_good`: it does, but only a new start damps again.
    `coil_apart`: the coil's current is not the graph's to take away, or nobody can see it.
    """

    name: str
    meaning: str
    injection: Injection
    reaction: Reaction
    words: str = ''
    lasts: float = 0.6  # s, chosen
    in_electronics: bool = False
    silent: bool = False
    ends_drive: bool = False
    for_good: bool = False
    options: tuple[str, ...] = ()
    shim: bool = False
    loses_samples: bool = False  # the fault itself keeps samples out of the recording
    coil_apart: bool = False
    third: bool = False  # one of the representative third
