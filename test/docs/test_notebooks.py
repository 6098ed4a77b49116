"""A notebook runs from its first cell to its last, and prints what stands in it."""

import pytest
from notebooks import NOTEBOOKS, executed, pictures, printed, read

LARGEST = 200_000  # bytes, chosen: a page of text and small pictures


@pytest.mark.parametrize('file', NOTEBOOKS, ids=lambda file: file.stem)
def test_a_notebook_prints_what_stands_in_it(file):
    stored, now = read(file), executed(file)
    assert printed(now) == printed(stored), 'python test/docs/notebooks.py renews it'
    assert pictures(now) == pictures(stored) > 0


@pytest.mark.parametrize('file', NOTEBOOKS, ids=lambda file: file.stem)
def test_a_notebook_is_small_and_tells_nothing_of_the_machine_that_ran_it(file):
    text = file.read_text(encoding='utf-8')
    assert len(text) < LARGEST
    assert 'metadata' not in {key for cell in read(file).cells for key in cell.metadata}
    assert '/home/' not in text
    assert '/tmp/' not in text
