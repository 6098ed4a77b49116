"""The report of one or several recordings: figures, page and pictures."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from engine_mount.recordings.compare import compare
from engine_mount.recordings.matching import ComparisonError, share_stamps
from engine_mount.recordings.recording import Recording, open_run
from engine_mount.reports.drawing.chart import COLOURS, SOLID
from engine_mount.reports.drawing.page import page
from engine_mount.reports.sections import motion, overview, run
from engine_mount.reports.sections.section import Section
from engine_mount.reports.sections.subject import Subject

OnStep = Callable[[float, str], None]
"""Called with the share of all that is done, and what is being done."""

SECTIONS: tuple[Callable[[Sequence[Subject]], Section | None], ...] = (
    motion.traces,
    motion.felt,
    motion.switching,
    motion.hysteresis,
    motion.harmonics,
    motion.spectra,
    run.coil,
    run.tracking,
    run.losses,
    run.differences,
    run.parameters,
)
"""What a report holds below its overview; a function returns None where it has nothing to say."""
_PAGE = 'report.html'
_TOGETHER = 6  # recordings in one report: more colours cannot be told apart


class ReportError(ValueError):
    """A report cannot be made; the text says why."""


@dataclass(frozen=True)
class Report:
    """A finished report on its subjects, and where its page and pictures were written."""

    title: str
    sections: Sequence[Section]
    failures: Sequence[str] = ()  # a sentence for each section that could not be made
    subjects: Sequence[Subject] = ()
    page: Path | None = None  # where it was written
    pictures: Sequence[Path] = ()

    @property
    def figures(self) -> Mapping[str, Any]:
        """Those of the first recording in SI units; None: unknown or not applicable."""
        return self.subjects[0].figures

    @property
    def html(self) -> str:
        """The page, which needs nothing else."""
        return page(self.title, self.sections)

    def write_page(self, file: Path) -> None:
        """Write the HTML page; raises `OSError`."""
        file.write_text(self.html, encoding='utf-8')

    def write_pictures(self, folder: Path, on_step: OnStep = lambda share, what: None) -> list[Path]:
        """Write each chart as a PNG of its name into `folder`, and return their paths; raises `OSError`."""
        from engine_mount.reports.drawing.picture import draw_chart  # what draws takes a second to load

        folder.mkdir(parents=True, exist_ok=True)
        charts = [section.chart for section in self.sections if section.chart is not None]
        files = [folder / f'{chart.name}.png' for chart in charts]
        for place, (chart, file) in enumerate(zip(charts, files, strict=True)):
            on_step(place / len(charts), f'drawing {file.name}')
            draw_chart(chart, file)
        return files


def report(
    path: str | Path | Sequence[str | Path],
    *,
    compare_with: str | Path | None = None,
    out: str | Path | None = None,
    pictures: str | Path | None = None,
    on_step: OnStep = lambda share, what: None,
) -> Report:
    """Return the report of the recordings or runs at `path`, and how the one to `compare_with` differs.

    Writes the page to `out` and its charts as PNG into the folder `pictures` where these are named. Raises
    `ReadingError` for what is no recording, `ReportError`.
    """
    paths = [path] if isinstance(path, str | Path) else path
    recordings = [part for each in paths for part in open_run(Path(each)).by_mount()]
    if compare_with is not None:
        recordings.append(open_run(Path(compare_with)))
    on_step(0.0, 'reading')
    subjects = subjects_of(recordings)
    if compare_with is not None:
        on_step(0.2, 'comparing')
        try:
            subjects[-1].comparison = compare(recordings[0], recordings[-1])
        except ComparisonError as error:
            raise ReportError(f'{error}; without --compare both can share a page') from None
    made = make_report(subjects, lambda share, what: on_step(0.2 + 0.4 * share, what))
    file, folder = (None if place is None else Path(place) for place in (out, pictures))
    drawn: list[Path] = []
    try:
        if file is not None:
            on_step(0.6, 'writing the page')
            file.parent.mkdir(parents=True, exist_ok=True)
            made.write_page(file)
        if folder is not None:
            drawn = made.write_pictures(folder, lambda share, what: on_step(0.7 + 0.3 * share, what))
    except OSError as error:
        place = error.filename or file
        raise ReportError(f'{place} cannot be written: {error.strerror}; choose another --out') from None
    return replace(made, page=file, pictures=drawn)


def default_page(path: Path) -> Path:
    """Return where the page of the recording or run at `path` goes: into the run's folder, else beside it."""
    if (path / 'recording').is_dir():
        return path / _PAGE
    path = path.absolute()
    if path.name == 'recording' and path.is_dir():
        return path.parent / _PAGE
    return path.with_name(f'{path.name if path.is_dir() else path.stem}_{_PAGE}')


def default_pictures(page: Path) -> Path:
    """Return the folder of the PNGs beside `page`: its name without `.html`."""
    named = page.name.removesuffix('.html')
    return page.with_name(named if named != page.name else f'{named}_pictures')


def subjects_of(recordings: Sequence[Recording]) -> list[Subject]:
    """Return the recordings as subjects of one report, on one time axis.

    Each has its own time axis; a recording whose stamps are those of the first one, such as a
    cut or a replay, keeps its place on the first one's axis. Raises `ReportError` for too many.
    """
    if len(recordings) > _TOGETHER:
        raise ReportError(
            f'{len(recordings)} recordings in one report are too many to tell apart; at most {_TOGETHER}'
        )
    subjects: list[Subject] = []
    for place, (recording, name) in enumerate(zip(recordings, _names(recordings), strict=True)):
        zero = subjects[0].zero if subjects and _shares_stamps(recordings[0], recording) else None
        subject = Subject(recording, name, several=len(recordings) > 1, zero=zero)
        if subject.mount in [each.mount for each in subjects]:
            subject.look = COLOURS[place], SOLID  # the look of the mount is that of the first recording of it
        subjects.append(subject)
    return subjects


def make_report(subjects: Sequence[Subject], on_step: OnStep) -> Report:
    """Return the report of `subjects`; in the place of a section that could not be made stands why."""
    made: list[Section] = []
    failures: list[str] = []
    # The overview last, because it also says what the others did not find.
    functions = (*SECTIONS, overview.overview)
    for place, make in enumerate(functions):
        name = make.__name__
        on_step(place / len(functions), name)
        try:
            section = make(subjects)
        except Exception as error:  # of any kind: the other sections are still of use
            failures.append(f'section {name} could not be made: {str(error) or type(error).__name__}')
            section = Section(name, name.capitalize(), [failures[-1].replace('section', 'Section', 1)])
        made += [] if section is None else [section]
    title = 'Report of ' + ' and '.join(subject.name for subject in subjects)
    return Report(title, [made[-1], *made[:-1]], failures, subjects)


def _names(recordings: Sequence[Recording]) -> list[str]:
    """Return short names that differ."""
    for parts in (1, 2, 3):
        names = []
        for recording in recordings:
            path = [part for part in recording.path.absolute().parts if part != 'recording']
            names.append(f'{"/".join(path[-parts:])} {recording.mount}'.strip())
        if len(set(names)) == len(names):
            return names
    return [f'{number}: {recording.path.absolute()}' for number, recording in enumerate(recordings, 1)]


def _shares_stamps(first: Recording, other: Recording) -> bool:
    try:
        return share_stamps(first, other)
    except ComparisonError:
        return False
