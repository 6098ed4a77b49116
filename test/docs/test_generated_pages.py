"""Pages of reference that a program writes are what it writes from the present sources."""

import commands_page
import fleet_columns_page
import names_page
import parameters_page
import pytest
import signals_page

WRITERS = (commands_page, fleet_columns_page, names_page, parameters_page, signals_page)


@pytest.mark.parametrize('writer', WRITERS, ids=lambda writer: writer.PAGE.stem)
def test_the_page_is_what_its_source_declares(writer):
    renewed_by = f'python test/docs/{writer.__name__}.py renews it'
    assert writer.PAGE.read_text(encoding='utf-8') == writer.page(), renewed_by


def test_a_bar_in_a_text_does_not_end_its_cell_of_a_table():
    assert signals_page.cell('|v| - dead zone\nof it') == r'\|v\| - dead zone of it'
