"""The report of one or several recordings: all sections, the page, and the pictures."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from engine_mount.recordings.matching import ComparisonError, share_stamps
from engine_mount.recordings.recording import Recording
from engine_mount.reports.drawing.page import page
from engine_mount.reports.sections import overview, run_sections, signal_sections
from engine_mount.reports.sections.section import Section
from engine_mount.reports.sections.subject import RunFacts, Subject
from engine_mount.reports.signals import Signals

OnStep = Callable[[str, float], None]
"""Called with what is being done, and the share of all that is done."""

MakeSection = Callable[[Sequence[Subject]], Section | None]

SECTIONS: tuple[MakeSection, ...] = (
    signal_sections.traces,
    signal_sections.signals,
    signal_sections.switching,
    signal_sections.loops,
    signal_sections.harmonics,
    signal_sections.spectra,
    signal_sections.sweep,
    run_sections.coil,
    run_sections.tracking,
    run_sections.losses,
    run_sections.differences,
    run_sections.parameters,
)
"""What a report holds below its overview; a function returns None where it has nothing to say."""

_TOGETHER = 6  # recordings in one report: more colours cannot be told apart


class ReportError(ValueError):
    """A report cannot be made; the text says why."""


@dataclass(frozen=True)
class Report:
    """A finished report, to be written."""

    title: str
    sections: Sequence[Section]
    failures: Sequence[str] = ()  # a sentence for each section that could not be made

    def write_page(self, file: Path) -> None:
        """Write the HTML page; raises `OSError`."""
        file.write_text(page(self.title, self.sections), encoding='utf-8')

    def write_pictures(self, folder: Path, on_picture: OnStep = lambda what, share: None) -> list[Path]:
        """Write each chart as a PNG of its name into `folder`, and return their paths; raises `OSError`."""
        from engine_mount.reports.drawing.picture import draw_chart  # what draws takes a second to load

        folder.mkdir(parents=True, exist_ok=True)
        charts = [section.chart for section in self.sections if section.chart is not None]
        files = []
        for place, chart in enumerate(charts):
            on_picture(f'drawing {chart.name}.png', place / len(charts))
            files.append(folder / f'{chart.name}.png')
            draw_chart(chart, files[-1])
        return files


def subjects_of(
    recordings: Sequence[Recording], facts: Callable[[Signals], RunFacts] = lambda signals: RunFacts()
) -> list[Subject]:
    """Return the recordings as subjects of one report, on one time axis.

    Each has its own time axis; a recording whose stamps are those of the first one, such as a
    cut or a replay, keeps its place on the first one's axis. Raises `ReportError` for too many.
    """
    if len(recordings) > _TOGETHER:
        raise ReportError(
            f'{len(recordings)} recordings in one report are too many to tell apart; at most {_TOGETHER}'
        )
    subjects: list[Subject] = []
    for recording, name in zip(recordings, _names(recordings), strict=True):
        signals = Signals(recording, name)
        if subjects and _shares_stamps(recordings[0], recording):
            signals.zero = subjects[0].signals.zero
        subjects.append(Subject(signals, facts(signals)))
    return subjects


def make_report(subjects: Sequence[Subject], on_step: OnStep = lambda what, share: None) -> Report:
    """Return the report of `subjects`; in the place of a section that could not be made stands why."""
    made: list[Section] = []
    failures: list[str] = []
    for place, make in enumerate(SECTIONS):
        on_step(make.__name__, place / len(SECTIONS))
        made += _section_or_reason(make, subjects, failures)
    # Last, because it also says what the others did not find.
    first = _section_or_reason(overview.overview, subjects, failures)
    title = 'Report of ' + ' and '.join(subject.name for subject in subjects)
    return Report(title, [*first, *made], failures)


def _section_or_reason(make: MakeSection, subjects: Sequence[Subject], failures: list[str]) -> list[Section]:
    what = make.__name__
    try:
        section = make(subjects)
    except Exception as error:  # of any kind: the other sections are still of use
        reason = str(error) or type(error).__name__
        failures.append(f'section {what} could not be made: {reason}')
        return [Section(what, what.capitalize(), [f'Section {what} could not be made: {reason}'])]
    return [] if section is None else [section]


def _names(recordings: Sequence[Recording]) -> list[str]:
    """Return short names that differ."""
    names = [recording.path.absolute() for recording in recordings]
    for parts in (1, 2, 3):
        short = ['/'.join([each for each in path.parts if each != 'recording'][-parts:]) for path in names]
        short = [
            f'{name} {recording.mount}'.strip() for name, recording in zip(short, recordings, strict=True)
        ]
        if len(set(short)) == len(short):
            return short
    return [f'{number}: {path}' for number, path in enumerate(names, 1)]


def _shares_stamps(first: Recording, other: Recording) -> bool:
    try:
        return share_stamps(first, other)
    except ComparisonError:
        return False
