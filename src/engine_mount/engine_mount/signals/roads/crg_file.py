"""The container of OpenCRG files: sections of text, and behind them a table of numbers.

Written from the description of the format (ASAM OpenCRG 1.2, chapter 3): text in ISO 8859-1 in lines of at
most 72 characters; a section is `$KEYWORD` .. `$`; `*` begins a line of comment, `!` a comment within a line;
behind the line that begins with `$$` numbers follow in records of 80 bytes.

| format | numbers | row |
|---|---|---|
| LRFI, LDFI | text of 10 or 20 characters, `*...` is NaN | begins a record of its own |
| KRBI, KDBI | IEEE 754, big-endian, 4 or 8 bytes | follows the last one; NaN fills the last record |
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from engine_mount.signals.roads.profile import FloatArray, ProfileError

_RECORD = 80  # bytes
_TEXT_WIDTHS = {'LRFI': 10, 'LDFI': 20}
_BINARY_TYPES = {'KRBI': '>f4', 'KDBI': '>f8'}
_DEFAULT_FORMAT = 'KRBI'
FORMATS = (*_TEXT_WIDTHS, *_BINARY_TYPES)


@dataclass(frozen=True)
class Channel:
    """A column of the table: what it is, its unit, and for a virtual one the numbers behind the unit."""

    title: str
    unit: str
    numbers: tuple[float, ...] = ()


@dataclass(frozen=True, eq=False)
class CrgFile:
    """Lines of each section by its keyword (without comments), channels, and the table (rows, channels).

    A file without a table, which only refers to another one, has no channels.
    """

    sections: Mapping[str, tuple[str, ...]]
    format: str
    channels: tuple[Channel, ...]
    virtual: tuple[Channel, ...]
    table: FloatArray

    def values(self, keyword: str) -> dict[str, float]:
        """Return the numbers of a section by their names in lower case; what is no number is left out."""
        found = {}
        for line in self.sections.get(keyword, ()):
            name, equals, text = line.partition('=')
            number = _number(text)
            if equals and number is not None:
                found[name.strip(' .\t').lower()] = number
        return found


def parse_crg(name: str, content: bytes) -> CrgFile:
    """Return the parts of a file with this content; raises `ProfileError` that names it."""
    sections, data = _sections(name, content)
    definition = sections.get('KD_DEFINITION', ())
    kind = next((line[2:].strip().upper() for line in definition if line.startswith('#:')), _DEFAULT_FORMAT)
    channels = tuple(_channel(line) for line in definition if line.upper().startswith('D:'))
    virtual = tuple(_channel(line) for line in definition if line.upper().startswith('U:'))
    if kind not in FORMATS:
        raise ProfileError(
            f'{name}: numbers in format {kind} are not read; OpenCRG knows {", ".join(FORMATS)}'
        )
    if data is None or not channels:
        return CrgFile(sections, kind, (), virtual, np.empty((0, 0)))
    if kind in _TEXT_WIDTHS:
        first_line = content[: len(content) - len(data)].count(b'\n') + 1
        table = _text_table(name, data, len(channels), _TEXT_WIDTHS[kind], first_line)
    else:
        table = _binary_table(name, data, len(channels), _BINARY_TYPES[kind])
    return CrgFile(sections, kind, channels, virtual, table)


def _sections(name: str, content: bytes) -> tuple[dict[str, tuple[str, ...]], bytes | None]:
    """Return the lines of each section and what stands behind them, None without a table."""
    sections: dict[str, tuple[str, ...]] = {}
    keyword, at = '', 0
    while at < len(content):
        end = content.find(b'\n', at)
        end = len(content) if end < 0 else end
        line = content[at:end].decode('latin-1').rstrip('\r')[:72]
        at = end + 1
        if not keyword and line.startswith('$$'):
            return sections, content[at:]
        if line.startswith('$') and not line.startswith('$$'):
            word = line[1:].partition('!')[0].split(' ')[0].strip().upper()
            if word and keyword:
                raise ProfileError(f'{name}: section ${word} begins before the end ($) of section ${keyword}')
            keyword = word
            sections.setdefault(keyword, ())
        elif keyword and not line.startswith('*') and line.partition('!')[0].strip():
            sections[keyword] += (line.partition('!')[0].strip(),)
    if keyword:
        raise ProfileError(
            f'{name}: the file ends within section ${keyword}; is it cut off, or no OpenCRG file?'
        )
    return sections, None


def _channel(line: str) -> Channel:
    title, *rest = (part.strip() for part in line[2:].split(','))
    numbers = tuple(number for number in map(_number, rest[1:]) if number is not None)
    return Channel(' '.join(title.split()).lower(), rest[0] if rest else '', numbers)


def _number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None


def _text_table(name: str, data: bytes, channels: int, width: int, first_line: int) -> FloatArray:
    lines = data.split(b'\n')
    while lines and not lines[-1].strip():
        lines.pop()
    in_record = _RECORD // width
    records = -(-channels // in_record)
    if len(lines) % records or not lines:
        raise ProfileError(
            f'{name}: {len(lines)} lines of numbers cannot be rows of {channels} channels in {records} lines '
            'each; is the file cut off?'
        )
    bytes_ = b''.join(line.rstrip(b'\r')[:_RECORD].ljust(_RECORD) for line in lines)
    cells = np.frombuffer(bytes_, f'S{width}').reshape(-1, records * in_record)[:, :channels]
    plain = np.char.strip(cells)
    missing = np.char.startswith(plain, b'*')
    try:
        return np.where(missing, b'nan', plain).astype(float)
    except ValueError:
        place = next(place for place, cell in enumerate(plain.ravel()) if not _is_number(bytes(cell)))
        row, column = divmod(place, channels)
        line = first_line + row * records + column // in_record
        raise ProfileError(
            f'{name}, line {line}: {bytes(cells[row, column]).decode("latin-1")!r} in place of channel '
            f'{column + 1} is no number; each has {width} characters'
        ) from None


def _is_number(cell: bytes) -> bool:
    return cell.startswith(b'*') or _number(cell.decode('latin-1')) is not None


def _binary_table(name: str, data: bytes, channels: int, kind: str) -> FloatArray:
    if len(data) % _RECORD:
        raise ProfileError(
            f'{name}: {len(data)} bytes of numbers are no whole records of {_RECORD} bytes; is the file cut '
            'off, or were line ends converted on its way?'
        )
    numbers = np.frombuffer(data, kind).astype(float)
    rows, over = divmod(numbers.size, channels)
    if not np.isnan(numbers[numbers.size - over :]).all():
        raise ProfileError(
            f'{name}: {numbers.size} numbers are no rows of {channels} channels, and what is left over is '
            'not the NaN that fills the last record; is the file cut off, or its $KD_DEFINITION another one?'
        )
    table = numbers[: rows * channels].reshape(rows, channels)
    filled = np.flatnonzero(~np.isnan(table).all(axis=1))
    return table[: filled[-1] + 1] if filled.size else table[:0]
