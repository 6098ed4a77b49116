"""The `engine-mount` command."""

import os
import sys
from typing import Annotated

import typer

from engine_mount.cli.commands import (
    accept,
    audit,
    bench,
    calibrate,
    check,
    compare,
    drive,
    edit,
    experiment,
    export,
    faults,
    fleet,
    identify,
    import_files,
    ls,
    record,
    replay,
    report,
    road,
    view,
)
from engine_mount.cli.commands.options import with_repeated_options
from engine_mount.cli.help import Command, Group, group
from engine_mount.cli.terminal import refuse, terminal
from engine_mount.signals.sources.uris import SourceError, StoreAwayError
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


_DEV = group('dev', 'This project on this machine: speed, faults, references, compilation.')
_EXPORT = group('export', 'Export for other programs and for the electronics.')
_EDIT = group('edit', 'Change recordings: cut a piece out, recover a damaged one.')

for _group, _panel, _functions in (
    (app, 'Drive and watch', (drive.drive, view.view, view.status, record.record, check.check)),
    (
        app,
        _RECORDINGS,
        (
            *(ls.ls, ls.info, report.report, replay.replay, compare.compare, audit.audit),
            import_files.import_file,
        ),
    ),
    (app, _MOUNT, (experiment.experiment,)),
    (_EXPORT, None, (export.signals, export.c)),
    (_EDIT, None, (edit.cut, edit.recover)),
    (_DEV, None, (faults.faults, bench.bench, accept.accept, prepare)),
):
    for _function in _functions:
        _name = _function.__name__.removesuffix('_file')
        _texts = vars(sys.modules[_function.__module__])
        _epilog = _texts.get(f'{_name.upper()}_EPILOG', _texts.get('EPILOG'))
        _group.command(_name, cls=Command, epilog=_epilog, rich_help_panel=_panel)(_function)
for _group, _panel in (
    *((_EXPORT, _RECORDINGS), (_EDIT, _RECORDINGS), (fleet.app, _RECORDINGS), (road.app, _RECORDINGS)),
    *((calibrate.app, _MOUNT), (identify.app, _MOUNT), (_DEV, 'This project')),
):
    app.add_typer(_group, rich_help_panel=_panel)

_UNUSABLE = (
    *(ValueError, FileExistsError, FileNotFoundError, IsADirectoryError, NotADirectoryError),
    *(PermissionError, SourceError),
)
"""Errors in what the user named; a drive that has begun raises `GraphError` instead."""


def main(arguments: list[str] | None = None) -> None:
    """Run the command; every refusal is one sentence and a non-zero exit code, 2 for a wrong use."""
    from mount_bringup.graph.nodes import GraphError
    from mount_bringup.graph.shutdown import INTERRUPTED, Interrupted
    from mount_ros.nodes.shutdown import end_process

    words = with_repeated_options(sys.argv[1:] if arguments is None else arguments)
    try:
        prepare_environment()
        code = app(args=words, prog_name='engine-mount', standalone_mode=False) or 0
        if code == INTERRUPTED:
            raise KeyboardInterrupt  # which Typer has caught
    except (KeyboardInterrupt, Interrupted) as end:
        terminal(stderr=True).print('; '.join(filter(None, ('interrupted', str(end)))), soft_wrap=True)
        code = INTERRUPTED
    except typer.TyperException as error:
        if sentence := _sentence(error):  # else the help of a group was printed
            refuse(sentence)
        code = error.exit_code
    except ModuleNotFoundError as error:
        if error.name != 'rclpy':
            raise
        refuse(
            'a running graph needs ROS 2 (rclpy), which is not installed; source a ROS 2 Jazzy installation '
            'or, on x86-64, call make setup; drive --core, replay, audit and report need none'
        )
        code = 2
    except (ValueError, GraphError, OSError) as error:
        refuse(error)
        code = 2 if isinstance(error, _UNUSABLE) and not isinstance(error, StoreAwayError) else 1
    end_process(code)


def _sentence(error: typer.TyperException) -> str:
    """Return what was wrong in the use of the command, without the words that Typer puts before it."""
    if near := getattr(error, 'possibilities', ()):
        return f'{error.message}; did you mean {" or ".join(near)}?'
    return error.format_message().removeprefix('Invalid value: ')
