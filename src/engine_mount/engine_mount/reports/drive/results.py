"""What a recorded drive ends with: figures, faults, picture and page."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from engine_mount.recordings.audit import audit
from engine_mount.recordings.losses import as_table, losses, sentences
from engine_mount.recordings.recording import Recording, open_recording
from engine_mount.recordings.screen import Screen
from engine_mount.reports.drive.evaluation import samples_at_the_ends
from engine_mount.reports.drive.signals import load_drive
from engine_mount.reports.drive.summary import (
    Figures,
    late_control,
    summarise,
    summary_table,
)
from engine_mount.settings.chosen import Parameters
from engine_mount.settings.options import mounts_of, settings_of_mounts
from engine_mount.settings.run_folder import RunFolder, write_json
from mount_recorder.folders import recordings_of

_COMMON = ('scenario', 'mode', 'samples', 'recordings', 'real_time_factor')  # to all mounts of a run


@dataclass
class DriveResult:
    """Figures, recordings, pictures, and a sentence for each thing that is not as it should be."""

    figures: Figures
    recordings: list[Path]
    complaints: list[str]
    pictures: list[Path] = field(default_factory=list)


def evaluate_drive(
    folder: RunFolder, parameters: Parameters, run: Figures, screen: Screen, *, report: bool
) -> DriveResult:
    """Print and write the figures of a drive, with `report` also its picture and its page.

    `run` is what the run itself knows, `parameters` those of its nodes. Of several mounts each has figures
    under `mounts`, a table and a picture; they share a page. Where the recorder was started again the figures
    are those of the longest recording, and the others are audited. A picture or page that cannot be made is a
    complaint.
    """
    recording, *others = _longest_first(recordings_of(folder.recording))
    places = sorted(entry.path for entry in (recording, *others))
    run = {**run, 'recordings': [str(place) for place in places]}
    result = DriveResult({}, places, list(recording.warnings))
    parts = [recording.of_mount(name) for name in mounts_of(parameters)] or [recording]
    figures = {
        part.mount: _evaluate_mount(part, settings, run, screen, result)
        for part, settings in zip(parts, settings_of_mounts(parameters).values(), strict=True)
    }
    several = '' not in figures
    result.figures = {**{name: run[name] for name in _COMMON}, 'mounts': figures} if several else figures['']
    result.complaints += [words for other in others for words in _audited(other, screen)]
    write_json(result.figures, folder.summary)
    if report:
        for part in parts:
            _draw(folder, part, screen, result)
        _make(folder.report, lambda: _write_page(folder, parts, screen), result)
    return result


def _evaluate_mount(
    recording: Recording, parameters: Parameters, run: Figures, screen: Screen, result: DriveResult
) -> Figures:
    """Print the figures of one mount; return them, add to `result` what is wrong."""
    with screen.line('evaluating the recording'):
        audits = audit(recording)
        found = losses(recording, audits)
        drive = load_drive(recording)
    mount = f'{recording.mount}: ' if recording.mount else ''
    complaints = [*found.complaints(), *samples_at_the_ends(recording, audits, run['samples'])]
    figures = summarise(recording, audits, found, drive, parameters, run)
    result.complaints += [f'{mount}{words}' for words in (*complaints, *late_control(figures))]
    screen.table(summary_table(figures, found, mount))
    screen.table(as_table(audits))
    recording.release()  # of several mounts one is in memory at a time
    return figures


def _longest_first(places: list[Path]) -> list[Recording]:
    """Return the recordings of a run, that of which its figures are made first."""

    def samples(recording: Recording) -> int:
        names = (f'/{mount}/displacement'.replace('//', '/') for mount in recording.mounts)
        return sum(recording.topics[name].message_count for name in names)

    return sorted(map(open_recording, places), key=samples, reverse=True)


def _audited(recording: Recording, screen: Screen) -> list[str]:
    """Say in one sentence what a recording holds; return what is not as it should be."""
    audits = audit(recording)
    found = losses(recording, audits)
    name = recording.path.name
    screen.say(f'{name}: {sentences(audits, found)[-1]}')
    return [*recording.warnings, *(f'{name}: {words}' for words in found.complaints())]


def _draw(folder: RunFolder, recording: Recording, screen: Screen, result: DriveResult) -> None:
    file = folder.figure
    if recording.mount:
        file = file.with_name(f'{file.stem}_{recording.mount}{file.suffix}')

    def draw() -> None:
        # after the drive: what draws takes a second to load
        from engine_mount.reports.sections.motion import draw_drive
        from engine_mount.reports.sections.subject import Subject

        draw_drive(Subject(recording), file, file.with_suffix('.svg'))
        result.pictures.append(file)

    with screen.line(f'drawing {file.name}'):
        _make(file, draw, result)


def _write_page(folder: RunFolder, parts: list[Recording], screen: Screen) -> None:
    from engine_mount.reports import report  # after the drive, as above

    with screen.bar('reading', transient=True) as show:
        made = report.make_report(report.subjects_of(parts), show)
        for failure in made.failures:
            screen.note(failure)
        made.write_page(folder.report)


def _make(file: Path, make: Callable[[], None], result: DriveResult) -> None:
    """Make the picture or page of a drive; what prevents it is a complaint, for the recording is there."""
    try:
        make()
    except Exception as error:  # of any kind: the recording is there
        result.complaints.append(f'{file.name} could not be made: {str(error) or type(error).__name__}')
