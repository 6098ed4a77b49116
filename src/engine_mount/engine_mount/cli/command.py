"""The `engine-mount` command."""

import sys
from collections.abc import Callable
from typing import Annotated

import typer

from engine_mount.cli.commands import (
    accept,
    audit,
    bench,
    calibrate,
    check,
    compare,
    cut,
    drive,
    experiment,
    faults,
    identify,
    import_files,
    ls,
    merge,
    record,
    recover,
    replay,
    report,
    road,
    version,
    view,
)
from engine_mount.cli.commands.fleet import group as fleet
from engine_mount.cli.commands.identify_arguments import with_repeated_options
from engine_mount.cli.help import Command, Group
from engine_mount.cli.terminal import refuse, terminal
from mount_ros.environment import prepare_environment

_DRIVE = 'Drive and watch'
_RECORDINGS = 'Recordings'
_CHANGE = 'Change recordings'
_MOUNT = 'Mount and paper'
_PROJECT = 'This project on this machine'

app = typer.Typer(
    cls=Group,
    name='engine-mount',
    help='Semi-active engine mount with dry friction: drive, record, look at what happened.',
    epilog="""Begin with `engine-mount drive`, then `engine-mount report` and `engine-mount replay`.
`engine-mount COMMAND --help` tells options, exit codes and examples.""",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode='markdown',
)


@app.callback()
def _top(
    show_version: Annotated[
        bool,
        typer.Option(
            '--version', is_eager=True, callback=version.tell, help='Tell what this is, and what it runs on.'
        ),
    ] = False,
) -> None:
    pass


def prepare() -> None:
    """Compile the laws for this machine, for drives and workers of a fleet; done by the set-up."""
    from engine_mount.fleet.example import prepare

    with terminal().status('compiling the laws for this machine (once, about half a minute)'):
        prepare()


_COMMANDS: tuple[tuple[str, str, Callable[..., None], str | None], ...] = (
    (_DRIVE, 'drive', drive.drive, drive.EPILOG),
    (_DRIVE, 'view', view.view, view.EPILOG),
    (_DRIVE, 'status', view.status, view.STATUS_EPILOG),
    (_DRIVE, 'record', record.record, record.EPILOG),
    (_RECORDINGS, 'ls', ls.ls, ls.EPILOG),
    (_RECORDINGS, 'info', ls.info, ls.INFO_EPILOG),
    (_RECORDINGS, 'report', report.report, report.EPILOG),
    (_RECORDINGS, 'replay', replay.replay, replay.EPILOG),
    (_RECORDINGS, 'compare', compare.compare, compare.EPILOG),
    (_RECORDINGS, 'audit', audit.audit, audit.EPILOG),
    (_CHANGE, 'import', import_files.import_files, import_files.EPILOG),
    (_CHANGE, 'cut', cut.cut, cut.EPILOG),
    (_CHANGE, 'merge', merge.merge, merge.EPILOG),
    (_CHANGE, 'recover', recover.recover, recover.EPILOG),
    (_MOUNT, 'experiment', experiment.experiment, experiment.EPILOG),
    (_PROJECT, 'check', check.check, check.EPILOG),
    (_PROJECT, 'faults', faults.faults, faults.EPILOG),
    (_PROJECT, 'bench', bench.bench, bench.EPILOG),
    (_PROJECT, 'accept', accept.accept, accept.EPILOG),
    (_PROJECT, 'prepare', prepare, None),
)
"""Panel of the help, name, function and epilog of each sub-command."""

for _panel, _name, _function, _epilog in _COMMANDS:
    app.command(name=_name, cls=Command, epilog=_epilog, rich_help_panel=_panel)(_function)
app.add_typer(fleet.app, rich_help_panel=_RECORDINGS)
app.add_typer(calibrate.app, rich_help_panel=_MOUNT)
app.add_typer(identify.app, rich_help_panel=_MOUNT)
app.add_typer(road.app, rich_help_panel=_RECORDINGS)


def main(arguments: list[str] | None = None) -> None:
    """Run the command; every refusal is one sentence and a non-zero exit code."""
    from mount_bringup.graph.nodes import GraphError
    from mount_bringup.graph.shutdown import INTERRUPTED, Interrupted
    from mount_ros.nodes.shutdown import end_process

    try:
        prepare_environment()
        app(args=with_repeated_options(sys.argv[1:] if arguments is None else arguments))
    except SystemExit as end:
        if not isinstance(end.code, int):
            raise
        end_process(end.code)
    except (KeyboardInterrupt, Interrupted) as end:
        terminal(stderr=True).print(f'interrupted; {str(end) or "the coil is at 0 A"}', soft_wrap=True)
        end_process(INTERRUPTED)
    except (ValueError, GraphError, OSError) as error:
        refuse(error)
        end_process(1)
