"""`engine-mount experiment`: repeats the paper's experiments and says where they do not come out."""

from pathlib import Path
from typing import Annotated

import typer

from engine_mount.cli.commands.options import (
    JsonFile,
    Listing,
    Page,
    argument,
    new_screen,
    option,
    write_figures,
)
from engine_mount.cli.help import named, setting

EPILOG = """Exit code: 0 when it ran, with any result; 2 when the order was refused.

Examples:

`engine-mount experiment --list` - all names

`engine-mount experiment sawtooth --json sawtooth.json` - one of them

`engine-mount experiment sawtooth --set sawtooth.friction.b_offset=-14` - with other pads

`engine-mount experiment all --page docs/explanation/experiments.md` - all, with the page and its pictures
"""


def experiment(
    names: Annotated[
        list[str] | None, argument('one, several, or all; see --list', 'NAME...', named('experiment'))
    ] = None,
    show: Listing = False,
    out: Annotated[
        Path | None, option('pictures and recordings; default: a new one in bags', 'FOLDER')
    ] = None,
    json_file: JsonFile = None,
    settings: Annotated[
        list[str] | None,
        option(
            'a parameter of the experiment or of a node; may be repeated',
            '[OWNER.]NAME=VALUE',
            setting,
            '--set',
        ),
    ] = None,
    page: Page = None,
) -> None:
    """Repeat experiments of the paper, each figure beside the statement of the paper.

    A statement that does not hold is a result, not an error: it is printed, and the exit code is 0.
    """
    from engine_mount.experiments.registry import experiments_named, known_settings, listed, orders
    from engine_mount.recordings.screen import Table

    screen = new_screen()
    if show:
        rows = [(name, f'{title} ({reference})') for name, reference, title in listed()]
        screen.table(Table('', 'll', rows, ('name', 'what is shown (in the paper)')))
        return
    from engine_mount.experiments.page import print_outcome, write_page
    from engine_mount.settings.options import settings_of_options

    if not names:
        raise typer.BadParameter('name an experiment, several, or all; --list tells which there are')
    chosen = experiments_named(names)
    given = settings_of_options(settings or [], known_settings(chosen))
    outcomes = []
    for known, order in orders(chosen, given, out):
        with screen.bar(known.name) as bar:
            outcomes.append(known.run(order.shown_on(bar)))
    for outcome in outcomes:
        print_outcome(outcome, screen)
    figures = {outcome.experiment.name: outcome.figures for outcome in outcomes}
    write_figures(figures if len(figures) > 1 else outcomes[0].figures, json_file)
    if page is not None:
        write_page(outcomes, page)
        screen.say(f'page       {page}')
