"""Each page can be reached, each link leads somewhere, and each page is of one of the four kinds."""

import re

import pytest
from notebooks import NOTEBOOKS, read
from pages import PAGES, REPOSITORY, anchors, name_of, without_blocks

DOCS = REPOSITORY / 'docs'
KINDS = {'tutorials', 'how-to', 'reference', 'explanation'}
LINK = re.compile(r'\[[^\]]*\]\(([^)\s]+)\)')


@pytest.mark.parametrize('page', PAGES, ids=name_of)
def test_every_link_leads_to_a_file_and_a_heading_of_it(page):
    assert_links_lead_somewhere(without_blocks(page), page)


@pytest.mark.parametrize('notebook', NOTEBOOKS, ids=name_of)
def test_every_link_of_a_notebook_does_too(notebook):
    texts = [cell.source for cell in read(notebook).cells if cell.cell_type == 'markdown']
    assert LINK.findall('\n'.join(texts))
    assert_links_lead_somewhere('\n'.join(texts), notebook)


def assert_links_lead_somewhere(text, page):
    for target in LINK.findall(text):
        if target.startswith('https://'):
            continue
        path, _, anchor = target.partition('#')
        file = (page.parent / path).resolve() if path else page
        assert file.exists(), f'{target} does not exist'
        assert not anchor or anchor in anchors(file), f'{target}: no such heading'


@pytest.mark.parametrize('page', PAGES, ids=name_of)
def test_every_page_that_is_named_without_a_link_exists(page):
    for named in re.findall(r'\bdocs/[\w/-]+\.(?:md|png)\b', page.read_text(encoding='utf-8')):
        assert (REPOSITORY / named).exists(), named


def test_every_page_is_of_one_kind_and_stands_in_the_index_once():
    files = [*DOCS.rglob('*.md'), *DOCS.rglob('*.ipynb')]
    pages = {page.relative_to(DOCS).as_posix() for page in files} - {'README.md'}
    assert {page.split('/')[0] for page in pages} == KINDS
    index = [target for target in LINK.findall((DOCS / 'README.md').read_text()) if target[0] != '.']
    assert sorted(index) == sorted(pages)


def test_every_page_of_docs_that_the_sources_name_exists():
    files = [
        *(REPOSITORY / 'src').rglob('*.py'),
        *(REPOSITORY / 'test').rglob('*.py'),
        REPOSITORY / 'Makefile',
    ]
    named = {
        name
        for file in files
        for name in re.findall(r'\bdocs/[\w/-]+\.md\b', file.read_text(encoding='utf-8'))
    }
    assert named
    assert [name for name in sorted(named) if not (REPOSITORY / name).exists()] == []
