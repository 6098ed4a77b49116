"""Every `--help`, as a new user sees it on a terminal of 80 columns."""

import re
import sys

import pytest
from command_line import commands
from typer.testing import CliRunner

from engine_mount.cli.command import app

RUNNER = CliRunner(env={'COLUMNS': '80', 'NO_COLOR': '1', 'TERM': 'dumb'})


COMMANDS = sorted(commands())


@pytest.mark.parametrize('words', ['', 'calibrate', *COMMANDS])
def test_help_fits_80_columns_names_no_type_of_python_and_gives_an_example(words):
    shown = RUNNER.invoke(app, [*words.split(), '--help'])
    assert shown.exit_code == 0
    assert max(map(len, shown.output.splitlines())) <= 80
    assert not re.search(r'<\w+|list\[|\{\w+\}', shown.output)
    if words in COMMANDS and words != 'dev prepare':
        assert f'engine-mount {words}' in shown.output.split('╯')[-1]
        assert 'xit code' in shown.output
    for option in re.findall(r'--[\w-]+ +NUMBER +(.*)', shown.output):
        assert option.strip(' │'), 'an option without a word of help'


def test_the_version_is_one_short_line():
    shown = RUNNER.invoke(app, ['--version'])
    assert shown.exit_code == 0
    assert re.fullmatch(r'engine-mount \S+, ROS 2 \w+ \(rclpy \S+\), Python \S+, numpy \S+\n', shown.output)
    assert f'Python {sys.version.split()[0]}' in shown.output
