"""How two sessions differ, in words: parameters, versions, scenario. Usually the reason of all else."""

import re
from collections.abc import Mapping
from typing import Any

from engine_mount.recordings.run.session import session_values

_OF_THE_MOMENT = re.compile(r'started|.*\.(uri|port)')  # differs from run to run and explains nothing
_LISTED = 3  # parameters that only one names


def session_differences(a: str, b: str) -> list[str]:
    """Return a sentence for each difference of two sessions (YAML texts), changed values first."""
    one, other = session_values(a), session_values(b)
    changed = [
        f'{name} is {_shown(one[name])} in A, {_shown(other[name])} in B'
        for name in one
        if name in other and not _same(one[name], other[name]) and not _OF_THE_MOMENT.fullmatch(name)
    ]
    return [*changed, *_only('A', one, other), *_only('B', other, one)]


def _same(one: Any, other: Any) -> bool:
    both_unknown = isinstance(one, float) and isinstance(other, float) and one != one and other != other
    return both_unknown or one == other


def _only(where: str, present: Mapping[str, Any], absent: Mapping[str, Any]) -> list[str]:
    names = [name for name in present if name not in absent and not _OF_THE_MOMENT.fullmatch(name)]
    if not names:
        return []
    shown = ', '.join(f'{name} ({_shown(present[name])})' for name in names[:_LISTED])
    more = f' and {len(names) - _LISTED} more' if len(names) > _LISTED else ''
    return [f'only {where} tells {shown}{more}']


def _shown(value: Any) -> str:
    return f'{value:g}' if isinstance(value, float) else str(value)
