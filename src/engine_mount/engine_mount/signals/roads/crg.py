"""A track of an OpenCRG file as height over distance.

Written from the description of the format (ASAM OpenCRG 1.2, chapter 3): text in ISO 8859-1 in lines of at
most 72 characters; a section is `$KEYWORD` .. `$`; `*` begins a line of comment, `!` a comment within a line;
behind the line that begins with `$$` numbers follow in records of 80 bytes.

| format | numbers | row |
|---|---|---|
| LRFI, LDFI | text of 10 or 20 characters, `*...` is NaN | begins a record of its own |
| KRBI, KDBI | IEEE 754, big-endian, 4 or 8 bytes | follows the last one; NaN fills the last record |
"""

import re
from contextlib import suppress

import numpy as np

from engine_mount.signals.signal import FloatArray, SignalError

FORMATS: dict[str, int | str] = {'LRFI': 10, 'LDFI': 20, 'KRBI': '>f4', 'KDBI': '>f8'}
"""Width of a number in characters, or its type."""
_RECORD = 80  # bytes
_SECTION = re.compile(r'long section (?:at v\s*=\s*(\S+)|(\d+))')
_V_INCREMENT = 0.01  # m: of numbered long sections where the header tells none (OpenCRG)
_SAME = 1e-6  # m

Sections = dict[str, list[str]]
Track = tuple[FloatArray, FloatArray, tuple[str, ...]]
"""Distances and heights (n,) in m, NaN where the file has none, and notes."""


def read_track(name: str, content: bytes, lateral: float) -> Track:
    """Return the track `lateral` m left of the reference line; raises `SignalError` that names the file."""
    sections, data, line = _sections(name, content)
    titles, units, table = _table(name, sections, data, line)
    road, scaled = _numbers(sections, 'ROAD_CRG'), _numbers(sections, 'ROAD_CRG_MODS')
    changed = [word for word, factor in scaled.items() if word.startswith('SCALE') and factor != 1.0]
    if changed:
        raise SignalError(
            f'{name}: {", ".join(changed)} in $ROAD_CRG_MODS changes the heights, which is not done here; '
            'write a file with the heights themselves'
        )
    first, increment = road.get('REFERENCE_LINE_START_U', 0.0), road.get('REFERENCE_LINE_INCREMENT', 0.0)
    if not increment > 0.0:
        raise SignalError(f'{name}: REFERENCE_LINE_INCREMENT in $ROAD_CRG ({increment:g}) must be above 0 m')
    end = road.get('REFERENCE_LINE_END_U', first)
    if end > first and len(table) < round((end - first) / increment) + 1:
        raise SignalError(
            f'{name}: {len(table)} rows of {increment:g} m from u = {first:g} m on, but REFERENCE_LINE_END_U '
            f'is {end:g} m; is the file cut off?'
        )
    places, columns = _long_sections(name, titles, units, road)
    if not places[0] - _SAME <= lateral <= places[-1] + _SAME:
        raise SignalError(
            f'{name}: no track at v = {lateral:g} m; its long sections are at {places[0]:g} .. '
            f'{places[-1]:g} m: choose one with --lateral'
        )
    notes = [f'track at v = {lateral:g} m of {places[0]:g} .. {places[-1]:g} m']
    weights = [float(np.interp(lateral, places, one)) for one in np.eye(places.size)]
    # a section without weight has no say, for it may lack a height
    parts = (
        weight * table[:, column] for weight, column in zip(weights, columns, strict=True) if weight > _SAME
    )
    height = sum(parts, np.zeros(len(table)))

    def reference_line(word: str, constant: str) -> FloatArray:
        if f'reference line {word}' in titles:
            return np.nan_to_num(table[:, titles.index(f'reference line {word}')])
        return np.full(len(table), road.get(constant, 0.0))

    slope = reference_line('slope', 'REFERENCE_LINE_START_S')
    banking = reference_line('banking', 'REFERENCE_LINE_START_B')
    slope[:1] = 0.0  # that in a row holds from the row before on
    if slope.any():
        notes.append(f'slope of the reference line, up to {np.abs(slope).max():.3g} m/m, is in the heights')
    if banking.any():
        notes.append(f'banking, up to {np.abs(banking).max():.3g} m/m, lifts this track with v')
    if 'reference line phi' in titles:
        notes.append('the heading is ignored: distances are those along the reference line')
    height = height + increment * np.cumsum(slope) + lateral * banking
    return first + increment * np.arange(height.size), height, tuple(notes)


def _sections(name: str, content: bytes) -> tuple[Sections, bytes, int]:
    """Return the lines of each section, and the numbers behind them with their first line."""
    sections: Sections = {}
    head, *data = re.split(rb'^\$\$.*\n?', content, maxsplit=1, flags=re.MULTILINE)
    keyword, lines = '', head.decode('latin-1').split('\n')
    for line in lines:
        text = line.rstrip('\r')[:72].partition('!')[0].strip()
        if line.startswith('$'):
            word = text[1:].split(' ')[0].upper()
            if word and keyword:
                raise SignalError(f'{name}: section ${word} begins before the end ($) of section ${keyword}')
            keyword = word
            sections.setdefault(keyword, [])
        elif keyword and text and not line.startswith('*'):
            sections[keyword].append(text)
    if data and not keyword:
        return sections, data[0], len(lines) + 1
    if keyword:
        raise SignalError(
            f'{name}: the file ends within section ${keyword}; is it cut off, or no OpenCRG file?'
        )
    reference = ''.join(sections.get('ROAD_CRG_FILE', ()))
    where = f'give the file that it refers to, {reference}' if reference else 'no line $$$$ is in it'
    raise SignalError(f'{name} has no table of heights: {where}')


def _numbers(sections: Sections, keyword: str) -> dict[str, float]:
    """Return the numbers of a section by their names; what is no number is left out."""
    found = {}
    for line in sections.get(keyword, ()):
        word, _, text = line.partition('=')
        with suppress(ValueError):
            found[word.strip(' .\t').upper()] = float(text)
    return found


def _table(name: str, sections: Sections, data: bytes, line: int) -> tuple[list[str], list[str], FloatArray]:
    """Return titles and units of the channels, and the numbers (rows, channels)."""
    definition = sections.get('KD_DEFINITION', [])
    kind = next((text[2:].strip().upper() for text in definition if text.startswith('#:')), 'KRBI')
    parts = [text[2:].partition(',') for text in definition if text.upper().startswith('D:')]
    if kind not in FORMATS or not parts:
        raise SignalError(
            f'{name}: numbers of {len(parts)} channels in format {kind} are not read; needed are channels in '
            f'$KD_DEFINITION, in {", ".join(FORMATS)}'
        )
    titles = [' '.join(title.split()).lower() for title, _, _ in parts]
    units = [unit.partition(',')[0].strip() for _, _, unit in parts]
    form = FORMATS[kind]
    if isinstance(form, int):
        return titles, units, _text_table(name, data, len(parts), form, line)
    return titles, units, _binary_table(name, data, len(parts), form)


def _long_sections(
    name: str, titles: list[str], units: list[str], road: dict[str, float]
) -> tuple[FloatArray, list[int]]:
    """Return the lateral places (m, rising) of the long sections and their columns."""
    matches = {column: match for column, title in enumerate(titles) if (match := _SECTION.fullmatch(title))}
    foreign = [f'{titles[column]} [{units[column]}]' for column in matches if units[column] != 'm']
    named = {float(match[1]): column for column, match in matches.items() if match[1]}
    numbered = {int(match[2]): column for column, match in matches.items() if match[2]}
    order = sorted(numbered)
    if foreign or len(matches) < 2 or (named and numbered) or order != list(range(1, len(order) + 1)):
        raise SignalError(
            f'{name}: channels must be long sections in m, all "at v = X" or all numbered from 1 on; instead '
            f'there are {", ".join(foreign or titles[:5])}: is it a road, or friction or colour of one?'
        )
    if named:
        return np.array(sorted(named)), [named[place] for place in sorted(named)]
    right, left = road.get('LONG_SECTION_V_RIGHT'), road.get('LONG_SECTION_V_LEFT')
    step = road.get('LONG_SECTION_V_INCREMENT', _V_INCREMENT)
    if right is not None and left is not None:
        step = (left - right) / (len(order) - 1)
    begin = -0.5 * step * (len(order) - 1) if right is None else right
    return begin + step * np.arange(len(order)), [numbered[number] for number in order]


def _text_table(name: str, data: bytes, channels: int, width: int, first: int) -> FloatArray:
    lines = data.rstrip().split(b'\n')
    records = -(-channels * width // _RECORD)
    if len(lines) % records:
        raise SignalError(
            f'{name}: {len(lines)} lines of numbers cannot be rows of {channels} channels in {records} lines '
            'each; is the file cut off?'
        )
    whole = b''.join(line.rstrip(b'\r')[:_RECORD].ljust(_RECORD) for line in lines)
    cells = np.char.strip(np.frombuffer(whole, f'S{width}').reshape(-1, records * _RECORD // width))
    cells = np.where(np.char.startswith(cells, b'*'), b'nan', cells)[:, :channels]
    numbers = np.empty(cells.size)
    for place, cell in enumerate(cells.ravel().tolist()):
        try:
            numbers[place] = float(cell)
        except ValueError as error:
            line = first + place // channels * records + place % channels * width // _RECORD
            raise SignalError(f'{name}, line {line}: {error}; each number has {width} characters') from None
    return numbers.reshape(cells.shape)


def _binary_table(name: str, data: bytes, channels: int, kind: str) -> FloatArray:
    if len(data) % _RECORD:
        raise SignalError(
            f'{name}: {len(data)} bytes of numbers are no whole records of {_RECORD} bytes; is the file cut '
            'off, or were line ends converted on its way?'
        )
    numbers = np.frombuffer(data, kind).astype(float)
    rows, over = divmod(numbers.size, channels)
    if not np.isnan(numbers[numbers.size - over :]).all():
        raise SignalError(
            f'{name}: {numbers.size} numbers are no rows of {channels} channels, and what is left over is '
            'not the NaN that fills the last record; is the file cut off, or its $KD_DEFINITION another one?'
        )
    table = numbers[: rows * channels].reshape(rows, channels)
    filled = np.flatnonzero(~np.isnan(table).all(axis=1))
    return table[: filled[-1] + 1] if filled.size else table[:0]
