"""The `engine-mount` command."""

import os
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
    export_c,
    faults,
    fleet,
    identify,
    import_files,
    ls,
    record,
    recover,
    replay,
    report,
    road,
    view,
)
from engine_mount.cli.commands.options import with_repeated_options
from engine_mount.cli.help import Command, Group, group
from engine_mount.cli.terminal import refuse, terminal
from mount_ros.environment import prepare_environment

_RECORDINGS = 'Recordings'
_MOUNT = 'Mount and paper'

app = typer.Typer(
    cls=Group,
    name='engine-mount',
    help='Semi-active engine mount with dry friction: drive, record, evaluate.',
    epilog="""Begin with `engine-mount drive`, then `engine-mount report` and `engine-mount replay`.
`engine-mount COMMAND --help` prints options, exit codes and examples.""",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode='markdown',
)


def _tell_versions(asked: bool) -> None:
    """Print the versions of project, ROS, Python and numpy, and end; the session of a recording tells all."""
    if not asked:
        return
    from mount_recorder.versions import versions

    found = versions()
    distribution = os.environ.get('ROS_DISTRO', 'jazzy')  # without one installed, rclpy is that of this
    terminal().print(
        f'engine-mount {found["mount_bringup"]}, ROS 2 {distribution} (rclpy {found["rclpy"]}), '
        f'Python {found["python"]}, numpy {found["numpy"]}',
        soft_wrap=True,
    )
    raise typer.Exit


@app.callback()
def _top(
    show_version: Annotated[
        bool,
        typer.Option(
            '--version',
            is_eager=True,
            callback=_tell_versions,
            help='Print the versions of this project and its libraries.',
        ),
    ] = False,
) -> None:
    pass


def prepare() -> None:
    """Compile the laws for this machine, for drives and workers of a fleet; done by the set-up."""
    from engine_mount.fleet.example import prepare

    with terminal().status('compiling the laws for this machine (once, about half a minute)'):
        prepare()


_COMMANDS: dict[str, tuple[tuple[Callable[..., None], str | None], ...]] = {
    'Drive and watch': (
        (drive.drive, drive.EPILOG),
        (view.view, view.EPILOG),
        (view.status, view.STATUS_EPILOG),
        (record.record, record.EPILOG),
    ),
    _RECORDINGS: (
        (ls.ls, ls.EPILOG),
        (ls.info, ls.INFO_EPILOG),
        (report.report, report.EPILOG),
        (replay.replay, replay.EPILOG),
        (compare.compare, compare.EPILOG),
        (audit.audit, audit.EPILOG),
    ),
    'Change recordings': (
        (import_files.import_file, import_files.EPILOG),
        (cut.cut, cut.EPILOG),
        (recover.recover, recover.EPILOG),
    ),
    _MOUNT: ((experiment.experiment, experiment.EPILOG),),
    'This project on this machine': (
        (check.check, check.EPILOG),
        (faults.faults, faults.EPILOG),
        (bench.bench, bench.EPILOG),
        (accept.accept, accept.EPILOG),
        (prepare, None),
    ),
}
"""Panel of the help: function and epilog of each sub-command."""

for _panel, _functions in _COMMANDS.items():
    for _function, _epilog in _functions:
        _name = _function.__name__.removesuffix('_file')
        app.command(_name, cls=Command, epilog=_epilog, rich_help_panel=_panel)(_function)
app.add_typer(fleet.app, rich_help_panel=_RECORDINGS)
app.add_typer(calibrate.app, rich_help_panel=_MOUNT)
app.add_typer(identify.app, rich_help_panel=_MOUNT)
app.add_typer(road.app, rich_help_panel=_RECORDINGS)
_EXPORT = group('export', 'Export for other programs and for the electronics.')
_EXPORT.command('c', cls=Command, epilog=export_c.EPILOG)(export_c.c)
app.add_typer(_EXPORT, rich_help_panel=_MOUNT)


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
