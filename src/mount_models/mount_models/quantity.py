"""Parameters declared in full: value, unit, sentence, range and source in one place.

A parameter set is a `typing.NamedTuple`, which is immutable, readable by name and understood by
compiled code. Each field is declared as ``Annotated[float, Quantity(unit, meaning, low, high,
source)] = default``.
"""

import difflib
import functools
import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple, TypeVar, get_type_hints

P = TypeVar('P', bound=NamedTuple)


class ParameterError(ValueError):
    """A parameter is missing, of the wrong kind or outside its range; the text says which and the remedy."""


class LawRefusedError(ValueError):
    """A law is not usable, or measurements lead to none; the text says why and the remedy."""


class OutsideLawError(ValueError):
    """A law was asked for something that it was never fitted to; the text says what and the remedy."""


@dataclass(frozen=True)
class Quantity:
    """What a value means: unit, one sentence, allowed range (inclusive) and where it comes from.

    With `may_be_unknown` NaN is allowed beside the range. A text has a kind in the place of the unit (word,
    name, path); `words` are those that it may be, where it is one of a few.
    """

    unit: str
    meaning: str
    low: float = -math.inf
    high: float = math.inf
    source: str = 'chosen'
    may_be_unknown: bool = False
    words: tuple[str, ...] = ()

    @property
    def limits(self) -> str:
        """What the value must keep to, for people; empty where it may be anything."""
        if self.words:
            return ', '.join(self.words)
        if math.isinf(self.low) and math.isinf(self.high):
            return ''
        return f'{self.low:g} .. {self.high:g}'


def check_name(owner: str, name: str, known: Collection[str]) -> None:
    """Raise `ParameterError` with the nearest names if `name` is none of the `known` ones of `owner`."""
    if name not in known:
        raise ParameterError(f'{name!r} is no parameter of {owner}; {nearest(name, known)}')


def nearest(name: str, known: Collection[str]) -> str:
    """Return the hint for a wrong name: the most similar of the `known` ones, all where none is similar."""
    near = difflib.get_close_matches(name, known, n=3)
    return f'did you mean {" or ".join(near)}?' if near else f'known are {", ".join(known)}'


def quantities(parameters: type[P] | P) -> dict[str, Quantity]:
    """Return the `Quantity` of every annotated field, by name."""
    kind = parameters if isinstance(parameters, type) else type(parameters)
    return dict(_quantities(kind))


@functools.cache
def _quantities(kind: type) -> dict[str, Quantity]:
    hints = get_type_hints(kind, include_extras=True)
    return {
        name: note
        for name, hint in hints.items()
        for note in getattr(hint, '__metadata__', ())
        if isinstance(note, Quantity)
    }


def checked(parameters: P) -> P:
    """Return `parameters` with every field in its declared type, or raise `ParameterError`."""
    hints, notes = _plain_hints(type(parameters)), _quantities(type(parameters))
    values = parameters._asdict().items()
    return parameters._replace(
        **{name: _checked_value(name, value, hints[name], notes.get(name)) for name, value in values}
    )


@functools.cache
def _plain_hints(kind: type) -> dict[str, Any]:
    return get_type_hints(kind)


def with_values(parameters: P, **changes: Any) -> P:
    """Return a checked copy of `parameters` with some fields changed; an unknown name is refused."""
    for name in changes:
        check_name(type(parameters).__name__, name, parameters._fields)
    return checked(parameters._replace(**changes))


def flattened(parameters: NamedTuple, prefix: str = '') -> dict[str, Any]:
    """Return {name: value} with nested sets as `outer.inner`, all behind `prefix.` where one is given."""
    flat: dict[str, Any] = {}
    for name, value in parameters._asdict().items():
        full = f'{prefix}.{name}' if prefix else name
        flat.update(flattened(value, full) if hasattr(value, '_asdict') else {full: value})
    return flat


def with_flattened(defaults: P, values: Mapping[str, Any], prefix: str = '') -> P:
    """Return the checked set `defaults` with those of `values` that name its fields as `flattened` does."""
    changes = {}
    for name, value in defaults._asdict().items():
        full = f'{prefix}.{name}' if prefix else name
        if hasattr(value, '_asdict'):
            changes[name] = with_flattened(value, values, full)
        elif full in values:
            changes[name] = values[full]
    try:
        return checked(defaults._replace(**changes))
    except ParameterError as error:
        raise ParameterError(f'{prefix}.{error}' if prefix else str(error)) from None


def _checked_value(name: str, value: Any, kind: Any, quantity: Quantity | None) -> Any:
    if kind not in (float, int, bool):
        return value
    if kind is bool:
        if not isinstance(value, bool):
            raise ParameterError(f'{name} must be true or false; instead received {value!r}')
        return value
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise ParameterError(f'{name} must be a number; instead received {value!r}')
    if kind is int and int(value) != value:
        raise ParameterError(f'{name} must be a whole number; instead received {value!r}')
    if quantity is not None and not (quantity.may_be_unknown and math.isnan(value)):
        check_range(name, value, quantity)
    return kind(value)


def check_range(name: str, value: float, quantity: Quantity) -> None:
    """Raise `ParameterError` where the value called `name` lies outside the range of its quantity."""
    if not quantity.low <= value <= quantity.high:
        raise ParameterError(
            f'{name} ({value:g} {quantity.unit}) must lie within '
            f'{quantity.low:g} .. {quantity.high:g} {quantity.unit}: {quantity.meaning}'
        )
