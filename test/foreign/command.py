"""The `engine-mount` command in this process, with what it printed and the code it ended with."""

from typer.testing import CliRunner, Result

from engine_mount.cli.command import app


def run(*words) -> Result:
    """Run the command; a refusal is the exception of the result."""
    return CliRunner().invoke(app, [str(word) for word in words])


def done(*words) -> str:
    """Run the command, which must end with code 0; return what it printed."""
    result = run(*words)
    assert result.exit_code == 0, f'{result.exception!r} {result.output}'
    return result.output


def refused(*words) -> str:
    """Run the command, which must be refused by a sentence; return the sentence."""
    result = run(*words)
    assert result.exit_code != 0, result.output
    assert isinstance(result.exception, ValueError | OSError | SystemExit), repr(result.exception)
    return result.output if isinstance(result.exception, SystemExit) else str(result.exception)
