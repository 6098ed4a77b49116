"""Writes the page and the pictures of a report, with a progress bar."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from engine_mount.recordings.compare import compare
from engine_mount.recordings.matching import ComparisonError
from engine_mount.recordings.recording import Recording
from engine_mount.recordings.screen import Screen
from engine_mount.reports.report import ReportError, make_report, subjects_of
from engine_mount.reports.run_facts import run_facts

PAGE = 'report.html'


def default_page(path: Path) -> Path:
    """Return where the page of the recording or run at `path` goes: into the run's folder, else beside it."""
    if (path / 'recording').is_dir():
        return path / PAGE
    if path.name == 'recording' and path.is_dir():
        return path.absolute().parent / PAGE
    return path.absolute().with_name(f'{path.absolute().name if path.is_dir() else path.stem}_{PAGE}')


def default_pictures(page: Path) -> Path:
    """Return the folder of the PNGs beside `page`: its name without `.html`."""
    named = page.name.removesuffix('.html')
    return page.with_name(named if named != page.name else f'{named}_pictures')


def write_report(
    recordings: Sequence[Recording],
    other: Recording | None,
    file: Path,
    pictures: Path | None,
    screen: Screen,
) -> list[Path]:
    """Write the page to `file` and its charts into `pictures` unless that is None; return those files.

    With `other`, it shares the charts and its differences from the first recording are told. What could
    not be made of the page is printed. Raises `ReportError`.
    """
    with screen.bar('reading', transient=True) as show:
        together = [*recordings, *([other] if other is not None else [])]
        subjects = subjects_of(together, run_facts)
        show(0.2, 'comparing')
        subjects[-1] = replace(subjects[-1], comparison=_comparison(recordings[0], other))
        made = make_report(subjects, lambda what, share: show(0.2 + 0.4 * share, what))
        for failure in made.failures:
            screen.note(failure)
        show(0.6, 'writing the page')
        try:
            file.parent.mkdir(parents=True, exist_ok=True)
            made.write_page(file)
            if pictures is None:
                return []
            return made.write_pictures(pictures, lambda what, share: show(0.7 + 0.3 * share, what))
        except OSError as error:
            raise ReportError(
                f'{error.filename or file} cannot be written: {error.strerror}; choose another --out'
            ) from None


def _comparison(first: Recording, other: Recording | None):
    try:
        return None if other is None else compare(first, other)
    except ComparisonError as error:
        raise ReportError(f'{error}; without --compare both can share a page') from None
