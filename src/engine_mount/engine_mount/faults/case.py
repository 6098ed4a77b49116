"""A fault of the matrix: how it is injected, and what the graph must do about it."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Any

import yaml

from mount_sim.electronics.faults import FAULTS


class Reaction(Enum):
    """What the graph must do; in each case without a traceback and with nothing left behind."""

    TOLERATED = 'damping goes on within 0 .. 3 A, no error is reported'
    TOLD = 'it is reported; the current stays within 0 .. 3 A'
    SAFE_WHILE = '0 A and reported while it lasts, then damping by itself'
    SAFE_UNTIL_INITIALISED = '0 A and reported; damping only after a new initialisation'
    REFUSED = 'refused, and nothing changes'
    NOT_STARTED = 'the initialisation refuses with a reason, 0 A'


SAFE = (Reaction.SAFE_WHILE, Reaction.SAFE_UNTIL_INITIALISED)
_FROM_START = 'from_start'  # a kind of fault that is there from the first sample on


@dataclass(frozen=True, eq=False)
class FaultCase:
    """One row of the matrix; `kind` and `argument` are those of its injection.

    `words` is a regular expression for the sentence that reports it. 0 A is looked for in the setpoints on
    the bus, or, where `in_electronics`, in what the electronics follow: where frames do not reach them, and
    where others send frames too. After `silent` faults 0 A is due 50 ms after they began. A graph of its own
    is started with `options` where there are any. `ends_drive`: the graph does not outlive it. `for_good`: it
    does, but only a new start damps again. `coil_apart`: the coil's current is not the graph's to take away,
    or nobody can see it. `loses_samples`: the fault itself keeps samples out of the recording. `third`: one
    of the representative third.
    """

    name: str
    meaning: str
    reaction: Reaction
    kind: str = _FROM_START
    argument: Any = ()
    words: str = ''
    lasts: float = 0.6  # s, chosen
    options: tuple[str, ...] = ()
    in_electronics: bool = False
    silent: bool = False
    ends_drive: bool = False
    for_good: bool = False
    loses_samples: bool = False
    coil_apart: bool = False
    third: bool = False

    @property
    def shim(self) -> bool:
        """Whether the processes of the graph are started with the shim."""
        return self.kind in ('clock_step', 'control_hang')


def _case(name: str, row: Mapping[str, Any]) -> FaultCase:
    fields = dict(row)
    ((kind, argument),) = fields.pop('inject', {'simulated': name}).items()
    options = tuple(fields.pop('options', ()))
    if kind == _FROM_START:
        options += ('--set', f'mount_sim.faults={json.dumps(argument)}')
    if 'meaning' not in fields:
        simulated = name.removesuffix('_at_start')
        fields['meaning'] = FAULTS[simulated].meaning + ', from the start' * (simulated != name)
    reaction = Reaction[fields.pop('reaction').upper()]
    return FaultCase(name, reaction=reaction, kind=kind, argument=argument, options=options, **fields)


MATRIX = {
    name: _case(name, row)
    for name, row in yaml.safe_load(Path(__file__).with_name('faults.yaml').read_text('utf-8')).items()
}
"""{name: fault}."""
