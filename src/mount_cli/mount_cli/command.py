"""The `engine-mount` command."""

import sys
from itertools import product

import typer

from mount_cli.commands import (
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
    merge,
    record,
    recover,
    replay,
    report,
    view,
)
from mount_cli.commands.identify_arguments import with_repeated_options
from mount_cli.terminal import refuse, terminal
from mount_ros.environment import prepare_environment

app = typer.Typer(
    name='engine-mount',
    help='Semi-active engine mount with dry friction: drive, record, look at what happened.',
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode='markdown',
)


@app.callback()
def _top() -> None:
    """Keep sub-commands even while there is only one."""


app.command(name='drive', epilog=drive.EPILOG)(drive.drive)


@app.command()
def prepare() -> None:
    """Compile the laws for this machine, so that the first drive need not wait; done by the set-up."""
    from mount_control.policy.registry import POLICIES
    from mount_replay.loop.run import run_core

    console = terminal()
    with console.status('compiling the laws for this machine (once, about half a minute)'):
        for scenario, policy in product(('bench', 'motorway'), POLICIES):
            sim = {'scenario': scenario, 'timeline.duration': 0.5}
            run_core({'mount_sim': sim, 'mount_control': {'policy': policy}}, lambda *_: None)


app.command(name='bench', epilog=bench.EPILOG)(bench.bench)
app.command(name='audit', epilog=audit.EPILOG)(audit.audit)
app.command(name='record', epilog=record.EPILOG)(record.record)
app.command(name='recover', epilog=recover.EPILOG)(recover.recover)
app.command(name='replay', epilog=replay.EPILOG)(replay.replay)
app.command(name='compare', epilog=compare.EPILOG)(compare.compare)
app.command(name='report', epilog=report.EPILOG)(report.report)
app.command(name='view', epilog=view.EPILOG)(view.view)
app.command(name='status', epilog=view.STATUS_EPILOG)(view.status)
app.command(name='cut', epilog=cut.EPILOG)(cut.cut)
app.command(name='merge', epilog=merge.EPILOG)(merge.merge)
app.command(name='experiment', epilog=experiment.EPILOG)(experiment.experiment)
app.command(name='check', epilog=check.EPILOG)(check.check)
app.command(name='faults', epilog=faults.EPILOG)(faults.faults)
app.add_typer(identify.app, name='identify')
app.command(name='accept', epilog=accept.EPILOG)(accept.accept)
app.add_typer(calibrate.app)


def main(arguments: list[str] | None = None) -> None:
    """Run the command; every refusal is one sentence and a non-zero exit code."""
    from mount_bringup.graph.errors import INTERRUPTED, GraphError, Interrupted
    from mount_ros.nodes.leaving import end_process

    try:
        prepare_environment()
        app(args=with_repeated_options(sys.argv[1:] if arguments is None else arguments))
    except SystemExit as end:
        if not isinstance(end.code, int):
            raise
        end_process(end.code)
    except (KeyboardInterrupt, Interrupted):
        terminal(stderr=True).print('interrupted; the coil is at 0 A')
        end_process(INTERRUPTED)
    except (ValueError, GraphError, OSError) as error:
        refuse(error)
        end_process(1)
