"""Writes docs/reference/fleet_columns.md: every column of a fleet's tables, as the code declares it.

`python test/docs/fleet_columns_page.py` renews the page; `test_generated_pages.py` holds it against the
declarations.
"""

from collections.abc import Sequence

from generated import PAGES, page_of, table, written_by

from engine_mount.fleet.job import COLUMNS, Column

PAGE = PAGES / 'fleet_columns.md'

HEAD = f"""# Columns of a fleet

What `engine-mount fleet query` can be asked: the tables `recordings` and `events` of a catalogue, `result` of
a replay, each a Parquet file of that name. {written_by(__file__)}
How they are made and asked: [fleet](../how-to/fleet.md). What is unknown is null.
"""
TYPES = {
    'string': 'text',
    'double': 'number',
    'int64': 'whole number',
    'bool': 'true or false',
    'timestamp[us]': 'time, UTC',
}


def page() -> str:
    """Return the text of the page."""
    parts = [HEAD]
    for name, of in (
        ('recordings', '`engine-mount fleet index`, a row for each mount of each recording'),
        ('events', '`engine-mount fleet index`, a row for each event'),
        ('result', '`engine-mount fleet replay`, a row for each mount of each recording'),
    ):
        parts += [f'## {name}', f'Made by {of}.', columns_table(COLUMNS[name])]
    return page_of(parts)


def columns_table(columns: Sequence[Column]) -> str:
    """Return the table of the columns of one table."""
    rows = [(f'`{each.name}`', TYPES[each.type], each.unit, each.meaning) for each in columns]
    return table(('column', 'type', 'unit', 'meaning'), rows)


if __name__ == '__main__':
    PAGE.write_text(page(), encoding='utf-8')
