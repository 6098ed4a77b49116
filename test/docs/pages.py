"""The pages for people, and what stands in them: links, blocks of commands, blocks of Python."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parents[2]
GUIDES = [
    REPOSITORY / 'README.md',
    REPOSITORY / 'CONTRIBUTING.md',
    REPOSITORY / 'bags' / 'README.md',
    *sorted((REPOSITORY / 'docs').rglob('*.md')),
]
"""Pages whose commands are run."""
PAGES = [*GUIDES, *sorted((REPOSITORY / 'src').glob('*/README.md')), REPOSITORY / 'CHANGELOG.md']

_BLOCK = re.compile(r'^```(\w*)\n(.*?)^```$', re.MULTILINE | re.DOTALL)


@dataclass(frozen=True)
class Block:
    """One fenced block: its language, empty for pictures made of letters, and its text."""

    language: str
    text: str


def name_of(page: Path) -> str:
    """Return the path of a page within the repository."""
    return page.relative_to(REPOSITORY).as_posix()


def blocks(page: Path, *languages: str) -> Iterator[Block]:
    """Return the blocks of a page in these languages, or in all where none is named, in their order."""
    for language, text in _BLOCK.findall(page.read_text(encoding='utf-8')):
        if language in languages or not languages:
            yield Block(language, text)


def without_blocks(page: Path) -> str:
    """Return the text of a page between its blocks."""
    return _BLOCK.sub('', page.read_text(encoding='utf-8'))


def anchors(page: Path) -> set[str]:
    """Return what a link to a heading of a page may say, made as Git forges make it."""
    headings = re.findall(r'^#+ (.+)$', without_blocks(page), re.MULTILINE)
    return {re.sub(r'[^\w\- ]', '', heading.lower()).replace(' ', '-') for heading in headings}
