"""What is told of a drive when it is recorded: figures, faults, picture and page."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from engine_mount.recordings.audit import audit
from engine_mount.recordings.losses import as_table, losses, sentences
from engine_mount.recordings.recording import Recording, open_recording
from engine_mount.recordings.screen import Screen
from engine_mount.reports.drive.evaluation import levels_of, samples_at_the_ends
from engine_mount.reports.drive.signals import DriveSignals, load_drive
from engine_mount.reports.drive.summary import (
    late_control,
    print_summary,
    snapshots_sentence,
    summarise,
    summarise_snapshots,
)
from engine_mount.reports.drive.undamped import Undamped, UndampedError, undamped_of
from engine_mount.reports.json_file import write_json
from engine_mount.settings.chosen import Parameters, policy_of
from engine_mount.settings.mounts import mounts_of, settings_of_mounts
from engine_mount.settings.run_folder import RunFolder
from mount_recorder.folders import recordings_of, saved_snapshots
from mount_recorder.parameters import RecorderParameters


@dataclass
class Told:
    """What was told: figures, recordings, and a sentence for each thing that was not as it should be."""

    figures: dict[str, Any]
    recordings: list[Path]
    complaints: list[str] = field(default_factory=list)
    pictures: list[Path] = field(default_factory=list)


def tell_drive(
    folder: RunFolder, parameters: Parameters, run: dict[str, Any], screen: Screen, *, report: bool
) -> Told:
    """Print and write the figures of a drive, with `report` also its picture and its page.

    `run` is what the run itself knows, `parameters` those of its nodes. Of several mounts each has figures
    under `mounts`, a table and a picture; they share a page. Where the recorder was started again the figures
    are those of the longest recording, and the others are audited. A picture or page that cannot be made is a
    complaint.
    """
    recording, *others = _longest_first(recordings_of(folder.recording))
    places = sorted(entry.path for entry in (recording, *others))
    run = {**run, 'recordings': [str(place) for place in places]}
    told = Told({}, places, list(recording.warnings))
    parts = [recording.of_mount(name) for name in mounts_of(parameters)] or [recording]
    figures = {
        part.mount: _tell_mount(folder, part, settings, run, screen, told, report=report)
        for part, settings in zip(parts, settings_of_mounts(parameters).values(), strict=True)
    }
    told.figures = figures[''] if '' in figures else {**_common(run), 'mounts': figures}
    told.complaints += [words for other in others for words in _audited(other, screen)]
    write_json(told.figures, folder.summary)
    if report:
        told.complaints += _complaint(folder.report, lambda: _write_report(folder, parts, screen))
    return told


def _common(run: dict[str, Any]) -> dict[str, Any]:
    """Return what is the same for all mounts of a run."""
    return {name: run[name] for name in ('scenario', 'mode', 'samples', 'recordings', 'real_time_factor')}


def _tell_mount(
    folder: RunFolder,
    recording: Recording,
    parameters: Parameters,
    run: dict[str, Any],
    screen: Screen,
    told: Told,
    *,
    report: bool,
) -> dict[str, Any]:
    """Print the figures of one mount and draw its picture; return them, add to `told` what is wrong."""
    with screen.line('evaluating the recording'):
        audits = audit(recording)
        found = losses(recording, audits)
        drive = load_drive(recording)
    mount = f'{recording.mount}: ' if recording.mount else ''
    complaints = [*found.complaints(), *samples_at_the_ends(recording, audits, run['samples'])]
    figures = summarise(recording, audits, found, drive, parameters, run)
    told.complaints += [f'{mount}{words}' for words in (*complaints, *late_control(figures))]
    print_summary(figures, found, screen, mount)
    screen.table(as_table(audits))
    if report:
        figure = folder.figure
        if recording.mount:
            figure = figure.with_name(f'{figure.stem}_{recording.mount}{figure.suffix}')
        with screen.line(f'simulating the undamped mount, drawing {figure.name}'):
            told.complaints += _complaint(
                figure, lambda: _draw(figure, parameters, drive, figures, _undamped(recording, parameters))
            )
        told.pictures += [figure] if figure.exists() else []
    recording.release()  # of several mounts one is in memory at a time
    return figures


def tell_snapshots(
    folder: RunFolder, recorder: RecorderParameters, run: dict[str, Any], screen: Screen
) -> Told:
    """Say what a run has that recorded only events: its figures would need all of the drive."""
    saved = saved_snapshots(folder.recording)
    complaints: list[str] = []
    for place in saved:
        complaints += _audited(open_recording(place), screen)
    screen.say(snapshots_sentence(len(saved), recorder))
    figures = summarise_snapshots(saved, run)
    write_json(figures, folder.summary)
    return Told(figures, saved, complaints)


def _longest_first(places: list[Path]) -> list[Recording]:
    """Return the recordings of a run, that of which its figures are made first."""

    def samples(recording: Recording) -> int:
        return sum(
            recording.topics[f'/{name}/displacement'.replace('//', '/')].message_count
            for name in recording.mounts
        )

    return sorted(map(open_recording, places), key=samples, reverse=True)


def _audited(recording: Recording, screen: Screen) -> list[str]:
    """Say in one sentence what a recording holds; return what is not as it should be."""
    audits = audit(recording)
    found = losses(recording, audits)
    name = recording.path.name
    screen.say(f'{name}: {sentences(audits, found)[-1]}')
    return [*recording.warnings, *(f'{name}: {words}' for words in found.complaints())]


def _draw(
    figure: Path,
    parameters: Parameters,
    drive: DriveSignals,
    figures: dict[str, Any],
    undamped: Undamped | None,
) -> None:
    from engine_mount.reports.drive.picture import (
        draw_drive,  # after the drive: what draws takes a second to load
    )

    levels = levels_of(*policy_of(parameters))
    title = f'{figures["scenario"]}, {figures["mode"]}: mount displacement and actuator current'
    grey = None
    if undamped is not None:
        grey = ((undamped.stamps - drive.zero) / 1e9, undamped.displacement)
    files = (figure, figure.with_suffix('.svg'))
    draw_drive(drive.seen, levels, figures['excitation_start_s'], title, files, grey, figures['mount'])


def _undamped(recording: Recording, parameters: Parameters) -> Undamped | None:
    try:
        return undamped_of(recording, parameters)
    except UndampedError:
        return None  # the page says why


def _write_report(folder: RunFolder, parts: list[Recording], screen: Screen) -> None:
    from engine_mount.reports.pages import write_report  # after the drive, as above

    write_report(parts, None, folder.report, None, screen)


def _complaint(file: Path, make: Callable[[], None]) -> list[str]:
    """Make the picture or page of a drive; what prevents it is a complaint, for the recording is there."""
    try:
        make()
    except Exception as error:  # of any kind: the recording is there
        return [f'{file.name} could not be made: {str(error) or type(error).__name__}']
    return []
