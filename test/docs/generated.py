"""What the writers of pages of reference share."""

from collections.abc import Iterable, Sequence
from pathlib import Path

PAGES = Path(__file__).resolve().parents[2] / 'docs' / 'reference'


def written_by(file: str) -> str:
    """Return the sentence that names the writer of a page."""
    return f'`python test/docs/{Path(file).name}` writes this page, and a test holds it against its source.'


def page_of(parts: Iterable[str]) -> str:
    """Return the text of a page with a blank line between its parts."""
    return '\n\n'.join(part.rstrip() for part in parts) + '\n'


def table(columns: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table of Markdown; what stands in a cell must not end it."""
    lines = [columns, ['---'] * len(columns), *rows]
    return '\n'.join('| ' + ' | '.join(map(cell, line)) + ' |' for line in lines).replace('| --- ', '|---')


def cell(text: str) -> str:
    """Return a text in one line, as it may stand in a table."""
    return ' '.join(text.split()).replace('|', '\\|')


def first_paragraph(docstring: str | None) -> str:
    """Return what a docstring says first."""
    return ' '.join((docstring or '').split('\n\n')[0].split())
