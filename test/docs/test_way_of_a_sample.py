"""The functions that a sample passes, as the page on architecture names them, are those of the code."""

import ast
import re
from pathlib import Path

from pages import REPOSITORY

PAGE = REPOSITORY / 'docs' / 'explanation' / 'architecture.md'


def test_every_function_on_the_way_of_a_sample_is_where_the_page_says():
    section = PAGE.read_text(encoding='utf-8').split('## The way of one sample')[1].split('\n## ')[0]
    rows = [line for line in section.splitlines() if line.startswith('| ')][1:]
    passed = [
        place for row in rows for place in re.findall(r'`(\w+)/([\w/]+\.py)`: ((?:`[\w.]+`(?:, )?)+)', row)
    ]
    assert len(passed) >= len(rows) > 5
    for package, file, names in passed:
        defined = functions_in(REPOSITORY / 'src' / package / package / file)
        assert set(re.findall(r'[\w.]+', names)) <= defined, file


def functions_in(file: Path) -> set[str]:
    """Return the functions of a file, and its methods as `Class.method`."""
    body = ast.parse(file.read_text(encoding='utf-8')).body
    return {function.name for function in body if isinstance(function, ast.FunctionDef)} | {
        f'{kind.name}.{part.name}'
        for kind in body
        if isinstance(kind, ast.ClassDef)
        for part in kind.body
        if isinstance(part, ast.FunctionDef)
    }
