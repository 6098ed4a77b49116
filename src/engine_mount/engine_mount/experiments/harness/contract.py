"""Lists of numbers as one parameter, written with commas."""

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path
from typing import Annotated, Any, NamedTuple, TypeVar

from mount_models.quantity import ParameterError, Quantity, flattened, with_flattened

P = TypeVar('P', bound=NamedTuple)

Seed = Annotated[int, Quantity('1', 'seed of the noise', 0, 2**31 - 1)]

Values = dict[str, Any]
"""Plain numbers, texts, lists and mappings by name."""
Settings = Mapping[str, Mapping[str, Any]]
"""{owner: {parameter: value}}; an owner is a node or an experiment."""

Progress = Callable[[float, str], None]
"""Takes the share that is done, 0 .. 1, and what is being done."""


class ExperimentError(ValueError):
    """An experiment cannot be run as ordered; the text says why and the remedy."""


class Holds(Enum):
    """Whether what the paper says came out."""

    YES = 'yes'
    PARTLY = 'partly'
    NO = 'no'
    NOT_COMPARABLE = 'not comparable'


@dataclass(frozen=True)
class Statement:
    """One thing that the paper says, and what came out.

    `reference` is where the paper says it, `paper` what it says, in our words, `found` what came out, with
    numbers.
    """

    reference: str
    paper: str
    found: str
    holds: Holds


@dataclass(frozen=True)
class Order:
    """What the user wants: a folder for what is made, {owner: {parameter: value}}, and the real nodes or not.

    The owner of a parameter is a node or the experiment itself.
    """

    out: Path
    settings: Settings = field(default_factory=dict)
    graph: bool = False


@dataclass(frozen=True)
class Outcome:
    """What came of it; `figures` is what `--json` writes, so it holds plain numbers, texts, lists, mappings.

    `pages` are texts of the experiment's own (Markdown) that find its pictures in `figures/`.
    """

    figures: Values
    pictures: list[Path] = field(default_factory=list)
    recordings: list[Path] = field(default_factory=list)
    statements: list[Statement] = field(default_factory=list)
    pages: list[Path] = field(default_factory=list)


@dataclass(frozen=True)
class Experiment:
    """One experiment; `defaults` is the parameter set that `--set NAME.PARAMETER=VALUE` changes.

    `reference` is what it repeats of the paper, `summary` one paragraph on how. `closed_loop`: it drives
    through controller and plant, so parameters of the nodes can be set too and `--graph` makes sense.
    `needs`: the parameter that only the user can give; such an experiment is not among `all`.
    """

    name: str
    title: str
    reference: str
    summary: str
    defaults: NamedTuple
    run: Callable[[Order, Progress], Outcome]
    closed_loop: bool = False
    needs: str = ''

    def known_settings(self) -> dict[str, Values]:
        """Return {name: {parameter: default}} of the experiment's own parameters."""
        return {self.name: flattened(self.defaults)}


def parameters_of(order: Order, name: str, defaults: P) -> P:
    """Return the checked parameters of the experiment `name` as ordered; raises `ParameterError`."""
    return with_flattened(defaults, order.settings.get(name, {}))


_EVEN = 0.02  # chosen: two rms count as even within so much of each other


def holds_if(answers: Collection[bool]) -> Holds:
    """Return that it holds where all answers are yes, partly where one is; without any nothing is known."""
    if not answers:
        return Holds.NOT_COMPARABLE
    return Holds.YES if all(answers) else Holds.PARTLY if any(answers) else Holds.NO


def holds_if_lower(ratios: Sequence[float]) -> Holds:
    """Return whether it holds that all values are lower than those that they are ratios to (1)."""
    return holds_if([ratio < 1.0 - _EVEN for ratio in ratios])


def numbers_of(name: str, text: str, low: float, high: float) -> list[float]:
    """Return the numbers in `text`; raises `ParameterError` for anything but different ones within limits.

    `name` is what the refusal calls the parameter.
    """
    try:
        values = [float(part) for part in text.split(',') if part.strip()]
    except ValueError:
        values = []
    if not values or not all(low <= value <= high for value in values) or len(set(values)) < len(values):
        raise ParameterError(
            f'{name} ({text!r}) must be different numbers within {low:g} .. {high:g}, separated by commas; '
            'a single one with a comma behind it'
        )
    return values


def write_page(parts: Iterable[str], file: Path) -> Path:
    """Write the parts of a page (Markdown) to `file` and return it."""
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text('\n'.join(parts), encoding='utf-8')
    return file
