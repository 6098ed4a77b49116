"""Writes docs/reference/signals.md: every frame and signal of the CAN bus, as the DBC declares it.

`python test/docs/signals_page.py` renews the page; `test_generated_pages.py` holds it against the DBC.
"""

from generated import PAGES, cell, page_of, table, written_by

from mount_driver.can_library import Database, Message, Signal
from mount_driver.protocol import DATABASE_FILE

PAGE = PAGES / 'signals.md'

HEAD = f"""# Signals on CAN

Every frame between electronics and host, from `src/mount_driver/mount_driver/dbc/mount.dbc`.
{written_by(__file__)} All numbers are little-endian; bits count from bit 0 of byte 0. Value = raw
number x step. What the receiver checks, and what the driver makes of each bit: [interface](interface.md#can).
How to build electronics that speak this: [wire other electronics](../how-to/wire_other_electronics.md).
"""


def page() -> str:
    """Return the text of the page."""
    database = Database()
    database.add_dbc_file(DATABASE_FILE)
    messages = sorted(database.messages, key=lambda message: message.frame_id)
    assert all(signal.byte_order == 'little_endian' for message in messages for signal in message.signals)
    frames = table(
        ('frame', 'identifier', 'bytes', 'sender', 'every', 'E2E data id', 'meaning'),
        [frame_row(message) for message in messages],
    )
    parts = [HEAD, '## Frames', frames]
    for message in messages:
        parts += [f'## {message.name}', signals_table(message)]
    return page_of(parts)


def frame_row(message: Message) -> tuple[str, ...]:
    """Return the row of one frame."""
    assert message.dbc is not None
    assert message.is_fd
    data_id = message.dbc.attributes['E2EDataId'].value
    link = f'[{message.name}](#{message.name.lower()})'
    identifier, period = f'0x{message.frame_id:X}', f'{message.cycle_time} ms'
    return (
        link, identifier, f'{message.length}', ', '.join(message.senders), period,
        f'{data_id} (0x{data_id:04X})', first_sentence(message.comment),
    )  # fmt: skip


def signals_table(message: Message) -> str:
    """Return the table of the signals of one frame."""
    columns = ('signal', 'bits', 'type', 'step', 'unit', 'range', 'meaning')
    signals = sorted(message.signals, key=lambda signal: signal.start)
    return table(columns, [signal_row(signal) for signal in signals])


def signal_row(signal: Signal) -> tuple[str, ...]:
    """Return the row of one signal."""
    last = signal.start + signal.length - 1
    bits = f'{signal.start}' if signal.length == 1 else f'{signal.start}..{last}'
    words = [f'{int(raw)}: {name}' for raw, name in (signal.choices or {}).items()]
    meaning = f'{signal.comment} {"; ".join(words)}' if words else signal.comment
    return (
        f'`{signal.name}`', bits, f'{"int" if signal.is_signed else "uint"}{signal.length}',
        f'{signal.scale}', signal.unit or '1', f'{signal.minimum} .. {signal.maximum}', meaning or '',
    )  # fmt: skip


def first_sentence(text: str | None) -> str:
    """Return a text up to its first full stop."""
    return cell((text or '').split('. ')[0].rstrip('.'))


if __name__ == '__main__':
    PAGE.write_text(page(), encoding='utf-8')
