"""Lines of a text file as UTF-8, block by block, whatever its encoding and its line ends."""

import codecs
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from engine_mount.signals.signal import SignalError

HEAD = 1 << 18
"""B at the beginning of a file by which its dialect is found, chosen: some thousand lines."""
_ELSEWHERE = 1 << 16  # B in the middle and at the end, chosen: a decimal sign may come late
_BLOCK = 1 << 22  # B read at once, chosen: larger ones are read no faster
_LONGEST = 1 << 24  # B, chosen: a line of samples is far shorter
_MARKS = (
    (codecs.BOM_UTF8, 'utf-8'),
    (codecs.BOM_UTF16_LE, 'utf-16-le'),
    (codecs.BOM_UTF16_BE, 'utf-16-be'),
)


@dataclass(frozen=True)
class Encoding:
    """How the bytes of a text are read: the codec, and how many bytes of mark stand before the text."""

    codec: str
    mark: int = 0

    @property
    def width(self) -> int:
        """The bytes of a plain letter."""
        return 2 if self.codec.startswith('utf-16') else 1


def encoding_of(path: Path) -> Encoding:
    """Return UTF-8 or UTF-16 by their marks or their bytes, else Windows-1252; raises `SignalError`."""
    with path.open('rb') as file:
        head = file.read(HEAD)
    if not head.strip():
        raise SignalError(f'{path} is empty; needed are lines of numbers')
    for mark, codec in _MARKS:
        if head.startswith(mark):
            return Encoding(codec, len(mark))
    zeros = [head[place::2].count(0) for place in (0, 1)]
    for codec, place in (('utf-16-be', 0), ('utf-16-le', 1)):
        if zeros[place] > 0.4 * len(head) / 2 and zeros[1 - place] == 0:
            return Encoding(codec)
    if any(zeros):
        raise SignalError(
            f'{path} is no text: byte {head.index(0)} is 0; give a text table, or name the file by its format'
        )
    try:
        codecs.getincrementaldecoder('utf-8')().decode(head)
    except UnicodeDecodeError:
        return Encoding('cp1252')
    return Encoding('utf-8')


def blocks(path: Path, encoding: Encoding, size: int = _BLOCK) -> Iterator[bytes]:
    """Yield whole lines as UTF-8, each ended by one line feed; raises `SignalError`."""
    decoder = codecs.getincrementaldecoder(encoding.codec)('replace')
    carried = b''
    with path.open('rb') as file:
        file.seek(encoding.mark)
        while True:
            raw = file.read(size)
            data = carried + _as_utf8(raw, encoding, decoder)
            held = b'\r' if data.endswith(b'\r') and raw else b''
            data = data[: len(data) - len(held)].replace(b'\r\n', b'\n').replace(b'\r', b'\n')
            if not raw:
                break
            end = data.rfind(b'\n') + 1
            if end:
                yield data[:end]
            carried = data[end:] + held
            if len(carried) > _LONGEST:
                raise SignalError(f'{path} has a line of more than {_LONGEST} bytes; is it a table of text?')
    if data:
        yield data if data.endswith(b'\n') else data + b'\n'


def sample(path: Path, encoding: Encoding) -> tuple[list[str], list[str]]:
    """Return the first lines of a file, and some of its middle and end."""
    first = next(blocks(path, encoding, HEAD), b'').decode(errors='replace').splitlines()
    size = path.stat().st_size
    others: list[str] = []
    for place in (size // 2, size - _ELSEWHERE) if size > HEAD + 2 * _ELSEWHERE else ():
        with path.open('rb') as file:
            file.seek(place - place % encoding.width + encoding.mark % encoding.width, os.SEEK_SET)
            text = file.read(_ELSEWHERE).decode(encoding.codec, 'replace')
        others += text.splitlines()[1:-1]
    return first, others


def _as_utf8(raw: bytes, encoding: Encoding, decoder: codecs.IncrementalDecoder) -> bytes:
    if encoding.codec == 'utf-8' or (encoding.codec == 'cp1252' and raw.isascii()):
        return raw
    return decoder.decode(raw, final=not raw).encode()
