"""What is told of a drive when it is recorded: figures, faults, picture and page."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rich.console import Console

from mount_bags.audit.audit import audit
from mount_bags.audit.losses import losses
from mount_bags.audit.report import as_table, sentences
from mount_bags.bag.recording import Recording, open_recording
from mount_bags.recorder.parameters import RecorderParameters
from mount_bags.recorder.snapshot import saved_snapshots
from mount_bags.run.folder import RunFolder
from mount_bringup.chosen import Parameters, switched_viscous_parameters
from mount_report.drive.evaluation import Drive, load_drive, samples_at_the_ends
from mount_report.drive.summary import (
    SUMMARISED,
    print_summary,
    snapshots_sentence,
    summarise,
    summarise_snapshots,
    write_json,
)


@dataclass
class Told:
    """What was told: figures, recordings, and a sentence for each thing that was not as it should be."""

    figures: dict[str, Any]
    recordings: list[Path]
    complaints: list[str] = field(default_factory=list)


def tell_drive(
    folder: RunFolder, parameters: Parameters, run: dict[str, Any], console: Console, *, report: bool
) -> Told:
    """Print and write the figures of a drive, with `report` also its picture and its page.

    `run` is what the run itself knows, `parameters` those of its nodes. A picture or page that cannot be made
    is a complaint.
    """
    recording = open_recording(folder.recording)
    drive_data = load_drive(recording, others=SUMMARISED)
    audits = audit(recording)
    found = losses(recording, audits)
    complaints = [*recording.warnings, *found.complaints()]
    complaints += samples_at_the_ends(recording, audits, run['samples'])
    figures = summarise(recording, audits, found, drive_data, parameters, run)
    write_json(figures, folder.summary)
    print_summary(figures, found, console)
    console.print(as_table(audits))
    if report:
        complaints += _complaint(folder.figure, lambda: _draw(folder, parameters, drive_data, figures))
        complaints += _complaint(folder.report, lambda: _write_report(folder, recording, console))
    return Told(figures, [folder.recording], complaints)


def tell_snapshots(
    folder: RunFolder, recorder: RecorderParameters, run: dict[str, Any], console: Console
) -> Told:
    """Say what a run has that recorded only events: its figures would need all of the drive."""
    saved = saved_snapshots(folder.recording)
    complaints: list[str] = []
    for place in saved:
        recording = open_recording(place)
        audits = audit(recording)
        found = losses(recording, audits)
        console.print(f'{place.name}: {sentences(audits, found)[-1]}', soft_wrap=True)
        complaints += [*recording.warnings, *(f'{place.name}: {words}' for words in found.complaints())]
    console.print(snapshots_sentence(len(saved), recorder), soft_wrap=True)
    figures = summarise_snapshots(saved, run)
    write_json(figures, folder.summary)
    return Told(figures, saved, complaints)


def _draw(folder: RunFolder, parameters: Parameters, drive_data: Drive, figures: dict[str, Any]) -> None:
    from mount_report.drive.figure import draw_drive  # after the drive: what draws takes a second to load

    control = switched_viscous_parameters(parameters)
    title = f'{figures["scenario"]}, {figures["mode"]}: mount displacement and actuator current'
    begin = figures['excitation_start_s']
    draw_drive(drive_data, control.switch_on_level, control.switch_off_level, begin, title, folder.figure)


def _write_report(folder: RunFolder, recording: Recording, console: Console) -> None:
    from mount_report.pages import write_report  # after the drive, as above

    write_report([recording], None, folder.report, None, console)


def _complaint(file: Path, make: Callable[[], None]) -> list[str]:
    """Make the picture or page of a drive; what prevents it is a complaint, for the recording is there."""
    try:
        make()
    except Exception as error:  # whatever it stumbles over
        return [f'{file.name} could not be made: {str(error) or type(error).__name__}']
    return []
