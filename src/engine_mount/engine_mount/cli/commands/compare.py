"""`engine-mount compare`: what is different between two recordings, in words."""

from typing import Annotated

import typer

from engine_mount.cli.commands.options import (
    JsonFile,
    flag,
    new_screen,
    option,
    recording_argument,
    write_figures,
)
from engine_mount.cli.fetching import local, named

EPILOG = """Examples:

`engine-mount compare bags/before bags/after` - to the bit

`engine-mount compare A B --tolerance current=0.01 --tolerance switching=0.002 --tolerance 0.1%`

`engine-mount compare bags/long bags/cut --common`; drawn: `engine-mount report A --compare B`
"""


def compare(
    a: Annotated[str, recording_argument('A')],
    b: Annotated[str, recording_argument('B', 'the other one')],
    tolerances: Annotated[
        list[str] | None,
        option(
            'signal=0.01 in its unit, signal=1% of its largest value, 1% for all, switching=0.002 in s; '
            'also topic=, topic.signal=',
            'NAME=VALUE',
            None,
            '--tolerance',
        ),
    ] = None,
    common: Annotated[bool, flag('--common', 'compare only the common time')] = False,
    json_file: JsonFile = None,
) -> None:
    """Print the differences between recordings A and B in sentences.

    Exit code 0: equal to the bit, or within the tolerances; 1: different; 2: not compared, for example
    because A or B is no recording.
    """
    from engine_mount import compare as compare_recordings
    from engine_mount.recordings.difference import signal_table
    from engine_mount.recordings.matching import alignment_sentence
    from engine_mount.recordings.recording import open_run

    screen = new_screen()
    recordings = open_run(local(a, screen)), open_run(local(b, screen))
    comparison = compare_recordings(*recordings, tolerances or [], common=common)
    screen.say(f'A {comparison.name_a}, B {comparison.name_b}')
    for sentence in comparison.sentences():
        screen.say(f'- {sentence}')
    if comparison.differing:
        screen.table(signal_table(comparison.signals))
    aligned = alignment_sentence(comparison.alignments)
    screen.say(f'Times are from the first displacement sample of A; {aligned}.')
    for recording in recordings:
        for warning in recording.warnings:
            screen.note(f'{named(recording.path)}: {warning}')
    write_figures(comparison.figures(), json_file)
    if not comparison.equal:
        raise typer.Exit(1)
