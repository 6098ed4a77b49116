"""What came of experiments, for people: in the terminal, and as a page with the pictures."""

import shutil
from collections.abc import Sequence
from pathlib import Path

from engine_mount.experiments.harness.contract import Experiment, Holds, Outcome
from engine_mount.recordings.screen import Screen, Table

_FIGURES = 'figures'
_HEAD = """# The paper's experiments, repeated

Lorenz, Heimann, Härtel: *A novel engine mount with semi-active dry friction damping*, Shock and Vibration 13
(2006) 559-571. `make experiments` writes this page and its pictures; nobody edits it. What the paper says
stands in our words. All measurements are simulated: an agreement says that method and laws do what the paper
tells, not that its hardware did. *partly* and *no* are results like others; *not comparable* means that the
paper gives too little, or that what was compared here is something else.
"""


def print_outcome(experiment: Experiment, outcome: Outcome, screen: Screen) -> None:
    """Print the statements of an experiment and the places of what it made."""
    rows = [
        (statement.reference, statement.paper, statement.found, statement.holds.value)
        for statement in outcome.statements
    ]
    heads = ('paper', 'says', 'here', 'holds')
    screen.table(Table(f'{experiment.title} ({experiment.reference})', 'llll', rows, heads, ruled=True))
    for kind, places in (
        ('figure', outcome.pictures),
        ('recording', outcome.recordings),
        ('page', outcome.pages),
    ):
        for place in places:
            screen.say(f'{kind:11}{place}')


def write_page(outcomes: Sequence[tuple[Experiment, Outcome]], file: Path) -> None:
    """Write the page to `file` (Markdown) and copy all pictures into the folder `figures` beside it.

    The experiments' own pages go beside it too. A single one that runs on what the user gave has nothing to
    do in a page about the paper: its own page becomes `file`.
    """
    folder = file.parent / _FIGURES
    folder.mkdir(parents=True, exist_ok=True)
    if len(outcomes) == 1 and outcomes[0][0].needs:
        _write_own_page(outcomes[0][1], file, folder)
        return
    parts = [_HEAD, _overview(outcomes)]
    for experiment, outcome in outcomes:
        for picture in outcome.pictures:
            shutil.copyfile(picture, folder / picture.name)
        for page in outcome.pages:
            shutil.copyfile(page, file.parent / page.name)
        parts.append(_section(experiment, outcome))
    file.write_text('\n'.join(parts), encoding='utf-8')


def _write_own_page(outcome: Outcome, file: Path, folder: Path) -> None:
    for picture in outcome.pictures:
        shutil.copyfile(picture, folder / picture.name)
    (page,) = outcome.pages
    shutil.copyfile(page, file)


def _overview(outcomes: Sequence[tuple[Experiment, Outcome]]) -> str:
    heads = ' | '.join(answer.value for answer in Holds)
    lines = [f'| experiment | paper | {heads} |', '|---|---|' + '---|' * len(Holds)]
    for experiment, outcome in outcomes:
        counts = [sum(s.holds is answer for s in outcome.statements) for answer in Holds]
        told = ' | '.join(str(count or '') for count in counts)
        lines.append(f'| [{experiment.title}](#{experiment.name}) | {experiment.reference} | {told} |')
    return '\n'.join(lines) + '\n'


def _section(experiment: Experiment, outcome: Outcome) -> str:
    lines = [
        f'## {experiment.name}',
        '',
        f'**{experiment.title}**, {experiment.reference}. {experiment.summary}',
        '',
    ]
    for picture in outcome.pictures:
        lines += [f'![{experiment.title}]({_FIGURES}/{picture.name})', '']
    lines += ['| paper | says | here | holds |', '|---|---|---|---|']
    lines += [f'| {s.reference} | {s.paper} | {s.found} | {s.holds.value} |' for s in outcome.statements]
    for page in outcome.pages:
        lines += ['', f'All of it: [{page.name}]({page.name})']
    lines += ['', f'`engine-mount experiment {experiment.name}`', '']
    return '\n'.join(lines)
