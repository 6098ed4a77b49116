"""The glossary says of each word once, in one sentence, what it means."""

import re

from pages import REPOSITORY

TEXT = (REPOSITORY / 'docs' / 'reference' / 'glossary.md').read_text(encoding='utf-8')
ROWS = re.findall(r'^\| (?!word |---)([^|]+) \| ([^|]+) \|$', TEXT, re.MULTILINE)


def test_every_word_stands_in_the_glossary_once():
    words = [word for row, _ in ROWS for word in row.split(', ')]
    assert len(words) > 50
    assert sorted(words) == sorted(set(words))


def test_every_meaning_is_one_sentence():
    sentence = re.compile(r'[A-Z][^.]*(?:\.(?! )[^.]*)*\.')
    assert [meaning for _, meaning in ROWS if not sentence.fullmatch(meaning)] == []
