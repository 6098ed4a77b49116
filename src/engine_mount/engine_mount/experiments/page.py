"""What came of experiments, for people: in the terminal, and as a page with the pictures."""

import shutil
from collections.abc import Sequence
from pathlib import Path

from engine_mount.experiments.harness.experiment import Holds, Outcome, table
from engine_mount.recordings.screen import Screen, Table

_HEAD = """# The paper's experiments, repeated

Lorenz, Heimann, Härtel: *A novel engine mount with semi-active dry friction damping*, Shock and Vibration 13
(2006) 559-571. `make experiments` writes this page and its pictures; do not edit it. The statements of the
paper stand in our words. All measurements are simulated: an agreement confirms method and laws of the paper,
not its hardware. *partly* and *no* are results like others. *not comparable* means that the paper gives too
little, or that this project compared something else. Each experiment names the policy that drove. Where ours
drove too, its answer stands in columns of its own; the first table counts those of the paper's policy.
"""


def print_outcome(outcome: Outcome, screen: Screen) -> None:
    """Print the claims of an experiment and the places of what it made."""
    known = outcome.experiment
    every, found = outcome.table()
    heads, *rows = ((*row[:4], *row[5:]) for row in (every, *found))  # six columns would be too narrow
    screen.table(Table(f'{known.title} ({known.reference})', 'l' * len(heads), rows, heads, ruled=True))
    made = {'figure': outcome.pictures, 'recording': outcome.recordings, 'page': outcome.pages}
    for kind, places in made.items():
        for place in places:
            screen.say(f'{kind:11}{place}')


def write_page(outcomes: Sequence[Outcome], file: Path) -> None:
    """Write the page to `file` (Markdown), the pictures into the folder `figures` beside it.

    The experiments' own pages go beside it too.
    """
    folder = file.parent / 'figures'
    folder.mkdir(parents=True, exist_ok=True)
    for outcome in outcomes:
        for picture in outcome.pictures:
            shutil.copyfile(picture, folder / picture.name)
        for page in outcome.pages:
            shutil.copyfile(page, file.parent / page.name)
    parts = [outcome.page() for outcome in outcomes]
    file.write_text('\n'.join([_HEAD, _overview(outcomes), *parts]), encoding='utf-8')


def _overview(outcomes: Sequence[Outcome]) -> str:
    rows = []
    for outcome in outcomes:
        known = outcome.experiment
        counts = [sum(each.holds is answer for each in outcome.claims) for answer in Holds]
        told = (str(count or '') for count in counts)
        rows.append((f'[{known.title}](#{known.name})', known.reference, *told))
    return table(('experiment', 'paper', *(answer.value for answer in Holds)), rows)
