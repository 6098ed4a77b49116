"""A workbook whose rows have a cell in the last column is refused before it fills the memory."""

import openpyxl
import pytest

from engine_mount.signals.formats import excel
from engine_mount.signals.formats.content import Stated
from engine_mount.signals.signal import SignalError


def test_rows_with_a_far_cell_are_refused_with_their_width(tmp_path, monkeypatch):
    monkeypatch.setattr(excel, '_MOST_CELLS', 100_000)
    book = openpyxl.Workbook()
    for row in range(1, 11):
        book.active[f'XFD{row}'] = 1.0
    book.save(tmp_path / 'wide.xlsx')
    with pytest.raises(SignalError, match=r'more than 100000 cells \(limit\), 16384 in a row: remove'):
        excel.Workbook(tmp_path / 'wide.xlsx', Stated())
