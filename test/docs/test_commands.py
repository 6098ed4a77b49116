"""What a page tells the reader to type is run, in its order, and prints what the page shows.

A block `sh` holds commands. A block `console` holds commands behind `$`, each with what it prints, where
`...` stands for what differs from machine to machine; the exit code is 0 unless `echo $?` shows another. A
block `python` is a script; one that begins with `# name.py` is written to that file. The blocks of a page
share one empty folder. What is not run here stands in `elsewhere.py`.
"""

import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import typer
from elsewhere import ELSEWHERE, STAND_INS
from pages import GUIDES, PAGES, REPOSITORY, Block, blocks, name_of
from typer.core import TyperCommand, TyperGroup

from engine_mount.cli.command import app

LANGUAGES = ('sh', 'console', 'python')
LIMIT = 240.0  # s: only a hang takes so long
STATUS = 'echo $?'
COMMAND = re.compile(r'(?:^(?:\$ )?|`)(?:\.venv/bin/)?engine-mount ((?:[^`\n\\]|\\\n)*)', re.MULTILINE)
WRITTEN = ('docs/explanation/recorded_drive.md',)  # it needs a recording that is not shipped
RUN = [page for page in GUIDES if any(blocks(page, *LANGUAGES))]
FIRST = ('README.md',)
"""Pages whose commands `make test` runs."""


@pytest.mark.parametrize(
    'page',
    [
        pytest.param(page, id=name_of(page), marks=() if name_of(page) in FIRST else pytest.mark.slow)
        for page in RUN
    ],
)
def test_the_commands_of_a_page_do_what_it_says(page, tmp_path, domain):
    if page.parent.name == 'bags':  # its commands renew a reference
        shutil.copytree(page.parent / 'reference', tmp_path / 'bags' / 'reference')
    environment = {
        **os.environ,
        'PATH': f'{Path(sys.executable).parent}{os.pathsep}{os.environ["PATH"]}',
        'ROS_DOMAIN_ID': str(domain),
        'COLUMNS': '80',
        'NO_COLOR': '1',
    }
    every = blocks(page, *LANGUAGES)  # one by one: a script without a name is there until the next one
    for command, shown, code in (step for block in every for step in steps(block, tmp_path)):
        if run_elsewhere(command):
            continue
        ended = subprocess.run(
            ['bash', '-c', STAND_INS.get(command, command)],
            cwd=tmp_path,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=LIMIT,
        )
        assert ended.returncode == code, f'{command}\n{ended.stdout}'
        assert agree(shown, ended.stdout), f'{command}\nthe page shows\n{shown}\nprinted was\n{ended.stdout}'


@pytest.mark.parametrize('page', [page for page in PAGES if name_of(page) not in WRITTEN], ids=name_of)
def test_no_command_stands_in_a_block_that_is_not_run(page):
    for block in blocks(page):
        if block.language not in ('sh', 'console', 'python'):
            commands = re.findall(r'^(?:\$ |make |engine-mount |ros2 ).*', block.text, re.MULTILINE)
            assert commands == [], 'mark the block as sh or console'


@pytest.mark.parametrize('page', PAGES, ids=name_of)
def test_every_command_that_a_page_names_exists_with_its_options(page):
    for text in COMMAND.findall(page.read_text(encoding='utf-8')):
        words = text.split('#')[0].replace('\\\n', ' ').split()
        command, words = found_command(words)
        known = {
            option for parameter in command.params for option in parameter.opts + parameter.secondary_opts
        }
        options = {word.split('=')[0] for word in words if re.match('--[a-z]', word)}
        assert options - known <= {'--help', '--version'}, text


@pytest.mark.parametrize('page', PAGES, ids=name_of)
def test_every_target_of_make_that_a_page_names_exists(page):
    targets = re.findall(r'^([a-z0-9-]+):', (REPOSITORY / 'Makefile').read_text(), re.MULTILINE)
    named = re.findall(r'(?:^|`)make ([a-z0-9-]+)', page.read_text(encoding='utf-8'), re.MULTILINE)
    assert set(named) <= set(targets)


def test_every_command_that_is_not_run_here_stands_on_a_page_and_is_run_where_the_list_says():
    of_pages = {
        command
        for page in RUN
        for block in blocks(page, 'sh', 'console')
        for command, _, _ in steps(block, Path())
    }
    assert of_pages >= set(STAND_INS)
    assert [begin for begin in ELSEWHERE if not any(each.startswith(begin) for each in of_pages)] == []
    for where in ELSEWHERE.values():
        assert all((REPOSITORY / file).exists() for file in re.findall(r'[\w/]+\.py', where)), where


def run_elsewhere(command: str) -> bool:
    """Return whether a command is run by another test."""
    return command not in STAND_INS and command.startswith(tuple(ELSEWHERE))


def steps(block: Block, folder: Path) -> list[tuple[str, str, int]]:
    """Return what to run of a block: command, output shown (empty: any), exit code."""
    if block.language == 'sh':
        return [(command, '', 0) for command in commands_of(block.text)]
    if block.language == 'console':
        return console_steps(block.text)
    if block.language == 'python':
        name = re.match(r'# (\w+\.py)\n', block.text)
        file = folder / (name[1] if name else 'block.py')
        file.write_text(block.text, encoding='utf-8')
        return [(f'python {file.name}', '', 0)]
    return []


def console_steps(text: str) -> list[tuple[str, str, int]]:
    """Return the steps of a block with prompts; `echo $?` belongs to the command before it."""
    found: list[tuple[str, str, int]] = []
    for part in re.split(r'^\$ ', text, flags=re.MULTILINE)[1:]:
        lines = part.splitlines(keepends=True)
        count = 1 + next(k for k, line in enumerate(lines) if not line.endswith('\\\n'))
        command, shown = ''.join(lines[:count]).strip(), ''.join(lines[count:])
        if command == STATUS:
            found[-1] = (*found[-1][:2], int(shown))
        else:
            found.append((command, shown, 0))
    return found


def agree(shown: str, printed: str) -> bool:
    """Return whether the words shown are those printed; `...` stands for any, nothing shown for all."""
    pattern = r'\s*'.join(re.escape(word).replace(re.escape('...'), '.*?') for word in shown.split())
    return not shown or re.fullmatch(pattern, ' '.join(printed.split()), re.DOTALL) is not None


def commands_of(text: str) -> list[str]:
    """Return the commands of a block without prompts, comments left out."""
    whole = text.replace('\\\n', ' ').splitlines()
    return [shlex.join(words) if '#' in line else line.strip() for line in whole if (words := words_of(line))]


def words_of(line: str) -> list[str]:
    return shlex.split(line, comments=True)


def found_command(words: list[str]) -> tuple[TyperCommand, list[str]]:
    """Return the (sub-)command that words name, and the rest of them."""
    command = typer.main.get_command(app)
    while isinstance(command, TyperGroup) and words and words[0] in command.commands:
        command, words = command.commands[words[0]], words[1:]
    assert not isinstance(command, TyperGroup) or not words or not words[0][0].islower(), words
    return command, words
