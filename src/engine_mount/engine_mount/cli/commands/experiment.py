"""`engine-mount experiment`: repeats the paper's experiments and says where they do not come out."""

from pathlib import Path
from typing import Annotated

import typer

from engine_mount.cli.completion import named, setting
from engine_mount.cli.terminal import terminal

EPILOG = """Exit code: 0 when it ran, whatever came out; 1 when the order was refused.

Examples:

`engine-mount experiment --list` - which there are

`engine-mount experiment sawtooth --json sawtooth.json` - one of them

`engine-mount experiment sawtooth --set sawtooth.friction.b_offset=-14` - with other pads

`engine-mount experiment all --page docs/explanation/experiments.md` - all, with the page and its pictures
"""


def experiment(
    names: Annotated[
        list[str] | None,
        typer.Argument(
            metavar='NAME...', help='one, several, or all; see --list', autocompletion=named('experiment')
        ),
    ] = None,
    show: Annotated[bool, typer.Option('--list', help='tell which experiments there are')] = False,
    out: Annotated[
        Path | None,
        typer.Option(metavar='FOLDER', help='pictures and recordings; default: a new one in bags'),
    ] = None,
    json_file: Annotated[
        Path | None, typer.Option('--json', metavar='FILE', help='write the figures; of several, by name')
    ] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option(
            '--set',
            metavar='[OWNER.]NAME=VALUE',
            help='a parameter of the experiment or of a node; may be repeated',
            autocompletion=setting,
        ),
    ] = None,
    page: Annotated[
        Path | None,
        typer.Option(metavar='FILE', help='write the page, and the pictures into figures beside it'),
    ] = None,
) -> None:
    """Repeat experiments of the paper, each figure beside what the paper says.

    A statement that does not come out is a result, not an error: it is told, and the exit code is 0.
    """
    from engine_mount.cli.screen import TerminalScreen
    from engine_mount.experiments.registry import experiments_named, known_settings, listed, orders
    from engine_mount.recordings.screen import Table

    console = terminal()
    if show:
        rows = [(name, f'{title} ({reference})') for name, reference, title in listed()]
        TerminalScreen(console).table(Table('', 'll', rows, ('name', 'what is shown (in the paper)')))
        return
    from engine_mount.experiments.page import print_outcome, write_page
    from engine_mount.reports.json_file import write_json
    from engine_mount.settings.options import settings_of_options
    from mount_bringup.settings import SettingError

    if not names:
        raise typer.BadParameter('name an experiment, several, or all; --list tells which there are')
    try:
        chosen = experiments_named(names)
        given = settings_of_options(settings or [], known_settings(chosen))
    except SettingError as error:
        raise typer.BadParameter(str(error)) from None
    screen, outcomes = TerminalScreen(console), []
    for known, order in orders(chosen, given, out):
        with screen.bar(known.name) as bar:
            outcomes.append(known.run(order.shown_on(bar)))
            bar(1.0, known.name)
    for outcome in outcomes:
        print_outcome(outcome, screen)
    if json_file is not None:
        figures = {outcome.experiment.name: outcome.figures for outcome in outcomes}
        write_json(figures if len(figures) > 1 else outcomes[0].figures, json_file)
    if page is not None:
        write_page(outcomes, page)
        console.print(f'page       {page}', soft_wrap=True)
