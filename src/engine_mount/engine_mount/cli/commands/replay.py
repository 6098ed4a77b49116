"""`engine-mount replay`: a recorded displacement through the same controller again."""

from typing import Annotated

import typer

from engine_mount.cli.commands.options import (
    JsonFile,
    NewFolder,
    Position,
    RecordingPlace,
    Settings,
    changes_of,
    new_screen,
    option,
    write_figures,
)
from engine_mount.cli.fetching import local

EPILOG = """Exit code: 0 when the setpoints equal the recorded ones, or a change was requested; 1 when they
differ; 2 when the order was refused.

Examples:

`engine-mount replay bags/first/recording` - equal to the recorded setpoints?

`engine-mount replay RECORDING --set switch_on_level=0.0006 --set damper=viscous_3000` - what if?

Import a displacement of another system first: `engine-mount import`.
"""


def replay(
    recording: RecordingPlace,
    settings: Settings = None,
    table: Annotated[str, option('current-force table of another RECORDING, or "default": calculated')] = '',
    out: NewFolder = None,
    json_file: JsonFile = None,
    position: Position = '',
) -> None:
    """Replay a recorded displacement through the same controller and compare the answers with the recording.

    Answers are compared to the last bit; parameters and tables can differ from the recorded ones.
    """
    from engine_mount.drives.inputs.input import DEFAULT_TABLE
    from engine_mount.drives.replay import replay as run_replay
    from engine_mount.recordings.screen import Table
    from engine_mount.settings.run_folder import new_place

    screen, changes = new_screen(), changes_of(settings)
    place = local(recording, screen)
    if table not in ('', DEFAULT_TABLE):
        table = str(local(table, screen))
    with screen.console.status('replaying'):
        replayed = run_replay(place, changes, table=table, mount=position, out=out or new_place('replay'))
    figures = replayed.figures
    screen.table(Table(f'replay of {figures["source"]}', 'll', replayed.rows()))
    for sentence in figures['notes']:
        screen.note(sentence)
    assert replayed.folder is not None
    for file in (replayed.folder.summary, json_file):
        write_figures(figures, file)
    screen.say(f'recording  {replayed.recording}')
    if not replayed.held:
        raise typer.Exit(1)
