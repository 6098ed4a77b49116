"""What an experiment is: parameters, a procedure, figures, claims of the paper, pictures."""

from collections import defaultdict
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, NamedTuple

from mount_models.damper import damper_curve
from mount_models.quantity import ParameterError, Quantity, with_flattened

Seed = Annotated[int, Quantity('1', 'seed of the noise', 0, 2**31 - 1)]
Workers = Annotated[int, Quantity('1', 'processes; 0: one for each core', 0, 256)]

Values = dict[str, Any]
"""Plain numbers, texts, lists and mappings by name."""
Settings = Mapping[str, Mapping[str, Any]]
"""{owner: {parameter: value}}; an owner is a node or an experiment."""

NAMES = {
    'force_characteristic': ('Force of the actuator over current and gap', 'Fig. 2'),
    'field_penetration': ("How far the ripple's field enters the iron", 'Fig. 3'),
    'inductance_map': ('Incremental inductance over current and gap', 'Fig. 4'),
    'ramp_and_hold': ('Ramp and hold of the sticking contact', 'Fig. 7'),
    'sawtooth': ('Friction contact alone on a saw tooth', 'Figs. 8 to 11'),
    'bench': ('Friction mount and hydromount on a test rack', 'Fig. 13'),
    'sweep': ('Front wheels from 1 to 50 Hz', 'Fig. 14'),
    'motorway_gap': ('Over a gap in the motorway', 'Fig. 15'),
    'policy': ('Control policies side by side', 'Figs. 13 to 15; Secs. 1, 5 to 7'),
}
"""{name of the experiment and its file: (title, section or figure of the paper)}."""


PAPER, OURS = 'switched_viscous', 'continuous_viscous'
"""The policy of the paper, with which its scenes are driven; ours, with which some are driven too."""


class ExperimentError(ValueError):
    """An experiment cannot be run as ordered; the text says why and the remedy."""


class Holds(Enum):
    """Whether what the paper says came out."""

    YES = 'yes'
    PARTLY = 'partly'
    NO = 'no'
    NOT_COMPARABLE = 'not comparable'


PARTLY, NOT_COMPARABLE = Holds.PARTLY, Holds.NOT_COMPARABLE
Verdict = tuple[Any, str]
"""`Holds`, or what is true or false, and a text on what came out, with numbers."""


class Claim(NamedTuple):
    """What the paper says at `reference`, in our words, what was `found`, and whether it holds."""

    reference: str
    paper: str
    found: str
    holds: Holds
    ours: Any = None  # the same `Claim` with our policy, where that was run too


Judge = Callable[[Any], Verdict]
_CLAIMS: dict[str, dict[str, Callable[[Any], Claim]]] = defaultdict(dict)


def claim(reference: str, *, paper: str) -> Callable[[Judge], Judge]:
    """Add a function from figures to a verdict to the claims about the experiment of its module."""

    def add(judge: Judge) -> Judge:
        def judged(figures: Any) -> Claim:
            answer, found = judge(figures)
            holds = answer if isinstance(answer, Holds) else Holds.YES if answer else Holds.NO
            return Claim(reference, in_one_line(paper), in_one_line(found), holds)

        _CLAIMS[judge.__module__][judge.__name__] = judged
        return judge

    return add


def in_one_line(text: str) -> str:
    """Return a text that was set in several lines as one."""
    return ' '.join(text.split())


@dataclass(frozen=True)
class Order:
    """What is wanted: a folder, the experiment's parameters and those of the nodes.

    `policy` is the one that drives; `progress` takes the share that is done, 0 .. 1, and what is being done.
    """

    experiment: str
    out: Path
    parameters: Any
    settings: Settings = field(default_factory=dict)
    policy: str = PAPER
    progress: Callable[[float, str], None] = lambda share, what: None

    def shown_on(self, bar: Callable[[float, str], None]) -> 'Order':
        """Return the order with its progress on a bar."""
        return replace(self, progress=lambda share, what: bar(share, f'{self.experiment}: {what}'))


class Findings(NamedTuple):
    """What a procedure returns; `figures` is what `--json` writes: plain numbers, texts, lists, mappings.

    `pictures` are {name: figure of matplotlib, or the file where one is written}; `pages` are {file name:
    Markdown}, which find the pictures in `figures/`. Claims are judged from `judged`, by default the figures,
    and for our policy from `ours`.
    """

    figures: Values
    pictures: Mapping[str, Any]
    recordings: Sequence[Path] = ()
    pages: Mapping[str, str] = MappingProxyType({})
    judged: Any = None
    ours: Any = None


@dataclass(frozen=True)
class Experiment:
    """One experiment; `defaults` is the parameter set that `--set NAME.PARAMETER=VALUE` changes.

    `summary` is one paragraph on how it repeats what `NAMES` says. `closed_loop`: it drives through
    controller and plant, so parameters of the nodes can be set too. `policies` are those that drive; where
    ours is one and `Findings` say nothing of it, the procedure runs again with it.
    """

    name: str
    summary: str
    defaults: NamedTuple
    procedure: Callable[[Order], Findings]
    closed_loop: bool = False
    policies: Sequence[str] = ()

    @property
    def title(self) -> str:
        """What it is about."""
        return NAMES[self.name][0]

    @property
    def reference(self) -> str:
        """What it repeats of the paper."""
        return NAMES[self.name][1]

    def order(self, out: Path, settings: Settings) -> Order:
        """Return the order with checked parameters; raises `ParameterError` for what is out of range."""
        parameters = with_flattened(self.defaults, settings.get(self.name, {}))
        if hasattr(parameters, 'damper'):
            damper_curve(parameters.damper)  # refuses an unknown one
        nodes = {node: values for node, values in settings.items() if node != self.name}
        return Order(self.name, out, parameters, nodes)

    def run(self, order: Order) -> 'Outcome':
        """Run the procedure, judge the claims, write pictures and pages."""
        from engine_mount.experiments.harness.drawing import finish  # here, for it takes long to load

        found = self.procedure(order)
        order.out.mkdir(parents=True, exist_ok=True)
        judged, ours = found.figures if found.judged is None else found.judged, found.ours
        if OURS in self.policies and ours is None:
            others = {node: values for node, values in order.settings.items() if node != 'mount_control'}
            again = replace(order, policy=OURS, out=order.out / OURS, settings=others)
            ours = self.procedure(again).figures
        claims = [
            judge(judged)._replace(ours=None if ours is None else judge(ours))
            for judge in _CLAIMS[self.procedure.__module__].values()
        ]
        folder = order.out / 'figures' if found.pages else order.out
        pictures = [
            figure if isinstance(figure, Path) else finish(figure, folder / f'{name}.png')
            for name, figure in found.pictures.items()
        ]
        for name, text in found.pages.items():
            (order.out / name).write_text(text, encoding='utf-8')
        pages = [order.out / name for name in found.pages]
        return Outcome(self, found.figures, claims, pictures, list(found.recordings), pages)


class Outcome(NamedTuple):
    """What came of an experiment: figures in SI units, claims with their verdicts, and the files it made."""

    experiment: Experiment
    figures: Values
    claims: list[Claim]
    pictures: list[Path]
    recordings: list[Path]
    pages: list[Path]

    def table(self) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
        """Return heads and rows about the claims; our policy has columns of its own."""
        answers = [[each, *([each.ours] if each.ours else [])] for each in self.claims]
        rows = [
            (
                each[0].reference,
                each[0].paper,
                *(text for one in each for text in (one.found, one.holds.value)),
            )
            for each in answers
        ]
        heads = ('paper', 'statement', 'here', 'holds', f'with `{OURS}`', 'holds with it')
        return heads[: len(rows[0])], rows

    def page(self) -> str:
        """Return Markdown about it: what the paper says beside what was found; pictures in `figures/`."""
        known = self.experiment
        pictures = ''.join(f'![{known.title}](figures/{each.name})\n\n' for each in self.pictures)
        pages = ''.join(f'\nThe whole page: [{each.name}]({each.name})\n' for each in self.pages)
        return f"""## {known.name}

**{known.title}**, {known.reference}. {in_one_line(known.summary)}

Policy: {', '.join(f'`{each}`' for each in known.policies) or 'none takes part'}.

{pictures}{table(*self.table())}{pages}
`engine-mount experiment {known.name}`
"""


def table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table in Markdown."""
    return table_rows([heads]) + '|' + '---|' * len(heads) + '\n' + table_rows(rows)


def table_rows(rows: Iterable[Sequence[str]]) -> str:
    """Return rows of a table in Markdown."""
    return ''.join(f'| {" | ".join(row)} |\n' for row in rows)


EVEN = 0.02  # chosen: two rms count as even within so much of each other


def holds_if(answers: Collection[bool]) -> Holds:
    """Return that it holds where all answers are yes, partly where one is; without any nothing is known."""
    if not answers:
        return NOT_COMPARABLE
    return Holds.YES if all(answers) else PARTLY if any(answers) else Holds.NO


def numbers_of(order: Order, name: str, low: float, high: float) -> list[float]:
    """Return the numbers that a parameter lists; they must be different and within limits."""
    text = getattr(order.parameters, name)
    try:
        values = [float(part) for part in text.split(',') if part.strip()]
    except ValueError:
        values = []
    if not values or not all(low <= value <= high for value in values) or len(set(values)) < len(values):
        raise ParameterError(
            f'{order.experiment}.{name} ({text!r}) must be different numbers within {low:g} .. {high:g}, '
            'separated by commas; a single one with a comma behind it'
        )
    return values
