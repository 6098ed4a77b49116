"""`engine-mount audit`: was anything lost in a recording?"""

import typer

from engine_mount.cli.commands.options import JsonFile, RecordingPlace, new_screen, write_figures
from engine_mount.cli.fetching import local

EPILOG = """Exit code: 0 when nothing is known to be lost, unanswered or wrong; 1 on loss, on damage, when
control left samples without a setpoint, or on faults; 2 when nothing can be read.

Examples:

`engine-mount audit bags/first/recording`

`engine-mount audit /data/rosbag2_2024_05_02 --json audit.json` - any rosbag2 recording

`engine-mount audit s3://bucket/drives/first` - fetched first; sftp, gs, http(s) and file too

A topic with a rate is judged by its stamps, every topic by the counts of the recorder, the file or its
metadata. Expected = present - duplicated + lost. Jitter is the rms deviation of the steps between
neighbouring stamps. Samples lost, samples unanswered and faults are the figures of `drive` and `report`.
The JSON holds them, and below `topics` for each topic `expected`, `present`, `lost`, `duplicated`,
`longest_gap_s` and more; unknown is null.
"""


def audit(recording: RecordingPlace, json_file: JsonFile = None) -> None:
    """Check a recording for losses, and its drive for faults; exit code 1 if there are any."""
    from engine_mount import audit as audit_recording

    screen = new_screen()
    place = local(recording, screen)
    with screen.console.status('reading'):
        found = audit_recording(place)
    screen.table(found.table)
    for sentence in found.sentences():
        screen.say(sentence)
    for warning in found.warnings:
        screen.note(warning)
    write_figures(found.figures, json_file)
    if not found.sound:
        raise typer.Exit(1)
