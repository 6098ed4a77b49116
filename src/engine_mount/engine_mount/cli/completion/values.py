"""The values that a shell offers for options and arguments, from `names.json` and from folders."""

import json
import os
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

FILE = Path(__file__).with_name('names.json')
"""Written by `python test/docs/parameters_page.py`: what the code knows takes half a second to load."""

Offered = list[tuple[str, str]]  # value, and what it means
Completer = Callable[[str], Offered]

_BAGS = Path('bags')


def named(kind: str) -> Completer:
    """Return the completer of one name of a kind, such as `scenario`."""

    def offer(incomplete: str) -> Offered:
        return _beginning(incomplete, _names()[kind].items())

    return offer


def listed(kind: str) -> Completer:
    """Return the completer of names of a kind with commas between them."""

    def offer(incomplete: str) -> Offered:
        before, comma, last = incomplete.rpartition(',')
        taken = before.split(',')
        return [
            (f'{before}{comma}{name}', meaning)
            for name, meaning in _beginning(last, _names()[kind].items())
            if name not in taken
        ]

    return offer


def setting(*owners: str) -> Completer:
    """Return the completer of `--set` for the parameters of `owners`, all there are without any.

    A name comes with its default, to be overwritten; behind `=` come the words that it may be.
    """

    def offer(incomplete: str) -> Offered:
        name, equals, begun = incomplete.partition('=')
        if equals:
            return [(f'{name}={word}', '') for word in _words(name) if word.startswith(begun)]
        return _beginning(incomplete, _settings(owners, bare=bool(incomplete)))

    return offer


def faults(incomplete: str) -> Offered:
    """Offer the faults of the simulator; when they begin has to be written behind the `@`."""
    mount, slash, name = incomplete.rpartition('/')
    found = _beginning(name, {'list': 'tells which there are', **_names()['fault']}.items())
    return [(f'{mount}{slash}{value}', meaning) for value, meaning in found]


def recordings(incomplete: str) -> Offered:
    """Offer runs and recordings in `bags`, or beside what is begun, the newest first."""
    base = Path(incomplete).parent if os.sep in incomplete else _BAGS
    shown = [path for path in (base.iterdir() if base.is_dir() else ()) if _is_recording(path)]
    shown.sort(key=lambda path: path.stat().st_mtime, reverse=True)
    found = [(str(path), '') for path in shown]
    return [entry for entry in found if entry[0].startswith(incomplete)]


def references(incomplete: str) -> Offered:
    """Offer the references that there are."""
    folder = _BAGS / 'reference'
    found = sorted(path.name for path in folder.iterdir()) if folder.is_dir() else []
    return [(name, '') for name in found if name.startswith(incomplete)]


def _is_recording(path: Path) -> bool:
    return path.suffix == '.mcap' or any(
        (place / 'metadata.yaml').is_file() for place in (path, path / 'recording')
    )


def _settings(owners: tuple[str, ...], *, bare: bool) -> Iterator[tuple[str, str]]:
    for owner, parameters in _names()['parameters'].items():
        if owners and owner not in owners:
            continue
        for name, told in parameters.items():
            default, _, meaning = told.partition('\t')
            yield f'{owner}.{name}={default}', meaning
            if bare:
                yield f'{name}={default}', f'{owner}: {meaning}'


def _words(name: str) -> list[str]:
    """Return the words that a parameter may be, by the last part of its name."""
    last = name.rpartition('.')[2]
    return list(_names().get(last, {})) if last in _names()['words'] else []


def _beginning(incomplete: str, names: Any) -> Offered:
    return [(name, meaning) for name, meaning in names if name.startswith(incomplete)]


@cache
def _names() -> dict[str, Any]:
    found: dict[str, Any] = json.loads(FILE.read_text(encoding='utf-8'))
    return found
