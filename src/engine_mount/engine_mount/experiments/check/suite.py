"""The suite: manoeuvres with their limits, from one YAML file."""

import importlib.resources
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from engine_mount.experiments.harness.experiment import Settings
from mount_bringup.settings import checked_settings
from mount_models.plain_yaml import YamlError, plain_yaml, text_of_file
from mount_models.quantity import ParameterError, check_name

BANDS = ((3.0, 14.0), (14.0, 20.0), (20.0, 30.0), (30.0, 50.0), (20.0, 200.0))
"""Hz: resonance of the engine; the isolation bands of the sweep; what the chassis passes on as sound."""
REFERENCES = ('hydromount', 'undamped')
ROAD, RACK, CLOCK = 'road', 'rack', 'clock'


@dataclass(frozen=True)
class Measure:
    """What a number means, its unit ('' for counts and ratios), and on which seat it can be told.

    One with the seat `CLOCK` is of real time and not judged in core and lock-step.
    """

    unit: str
    meaning: str
    seats: tuple[str, ...]


def _shipped(file: str) -> Any:
    """Return the content of a YAML file beside this module."""
    return plain_yaml(importlib.resources.files(__package__).joinpath(file).read_text(encoding='utf-8'))


MEASURES = {
    name: Measure(unit, meaning, tuple(seats.split()))
    for name, (unit, meaning, seats) in _shipped('measures.yaml').items()
}
"""{name: what it means}. A number that is not known is exceeded, whatever its limit."""


SOURCES = ('contract', 'derived', 'paper', 'chosen')
"""Where the number of a limit comes from; `chosen` ones are a decision of whoever wrote the suite."""
_BOUNDS = ('at_most', 'at_least')
_NODES = ('mount_sim', 'mount_control', 'mount_init', 'mount_driver')
_OF_SUITE, _OF_MANOEUVRE = ('about', 'limits', 'manoeuvres'), ('about', 'evaluated_from_s', 'set', 'limits')
_OF_LIMIT = (*_BOUNDS, 'source', 'reason')
_LONGEST_NAME = 10  # characters: the table of verdicts fits 80 columns


class SuiteError(ValueError):
    """A suite cannot be used; the text says where, why and the remedy."""


@dataclass(frozen=True)
class Limit:
    """A bound of a measure: `at_most` or `at_least` so much, and where that comes from.

    A `common` one is shared with all manoeuvres of the suite.
    """

    measure: str
    bound: str
    value: float
    source: str
    reason: str
    common: bool


@dataclass(frozen=True)
class Manoeuvre:
    """A drive with limits: {node: {parameter: value}}, looked at from so many s of excitation on."""

    name: str
    about: str
    evaluated_from: float
    settings: Settings
    limits: tuple[Limit, ...] = ()

    @property
    def seat(self) -> str:
        """`RACK` where the displacement is imposed, else `ROAD`."""
        return RACK if self.settings['mount_sim']['scenario'] == 'bench' else ROAD


def shipped_suite() -> tuple[Manoeuvre, ...]:
    """Return the manoeuvres that come with the package."""
    return suite_of(_shipped('suite.yaml'))


def suite_in_file(file: Path) -> tuple[Manoeuvre, ...]:
    """Return the manoeuvres of a file; raises `SuiteError` with its name."""
    try:
        return suite_of(plain_yaml(text_of_file(file)))
    except (YamlError, SuiteError) as error:
        raise SuiteError(f'suite {file}: {error}') from None


def suite_of(content: Any) -> tuple[Manoeuvre, ...]:
    """Return the manoeuvres of a suite's content; raises `SuiteError`."""
    told = _mapping('the suite', content, _OF_SUITE)
    common = tuple(_limits('limits', told.get('limits', {}), common=True))
    named = _mapping('manoeuvres', told.get('manoeuvres'))
    if not named:
        raise SuiteError('manoeuvres must name at least one manoeuvre')
    return tuple(_manoeuvre(name, entry, common) for name, entry in named.items())


def chosen_of(suite: Sequence[Manoeuvre], names: Collection[str]) -> tuple[Manoeuvre, ...]:
    """Return the manoeuvres of these names in the order of the suite, all without names."""
    known = [manoeuvre.name for manoeuvre in suite]
    for name in names:
        _check_key('the suite', name, known, 'manoeuvre')
    return tuple(manoeuvre for manoeuvre in suite if not names or manoeuvre.name in names)


def _manoeuvre(name: str, entry: Any, common: tuple[Limit, ...]) -> Manoeuvre:
    if len(name) > _LONGEST_NAME:
        raise SuiteError(f'{name}: a name has at most {_LONGEST_NAME} characters, this one {len(name)}')
    told = _mapping(name, entry, _OF_MANOEUVRE)
    begin = _number(f'{name}.evaluated_from_s', told.get('evaluated_from_s', 0.0))
    if begin < 0.0:
        raise SuiteError(f'{name}.evaluated_from_s ({begin:g} s) must be 0 or more')
    about = _text(f'{name}.about', told.get('about'))
    made = Manoeuvre(name, about, begin, _settings(name, told.get('set')))
    own = tuple(_limits(name, told.get('limits', {})))
    for limit in own:
        if made.seat not in MEASURES[limit.measure].seats:
            raise SuiteError(f'{name}: {limit.measure} cannot be told on a {made.seat}; leave it out')
    shared = (limit for limit in common if made.seat in MEASURES[limit.measure].seats)
    return replace(made, limits=(*own, *shared))


def _settings(name: str, entry: Any) -> Settings:
    settings: Settings = {}
    for key, value in _mapping(f'{name}.set', entry).items():
        node, _, parameter = key.partition('.')
        _check_key(f'{name}.set', node, _NODES, 'node')
        settings.setdefault(node, {})[parameter] = value
    try:
        checked = checked_settings(settings)
    except ParameterError as error:
        raise SuiteError(f'{name}.set: {error}') from None
    if 'scenario' not in checked.get('mount_sim', {}):
        raise SuiteError(f'{name}.set must have mount_sim.scenario, such as motorway')
    return checked


def _limits(name: str, entry: Any, *, common: bool = False) -> Iterator[Limit]:
    for measure, told in _mapping(f'{name}', entry).items():
        _check_key(name, measure, MEASURES, 'quantity')
        place = f'{name}.{measure}'
        limit = _mapping(place, told, _OF_LIMIT)
        source, reason = (_text(f'{place}.{key}', limit.get(key)) for key in ('source', 'reason'))
        if source not in SOURCES:
            raise SuiteError(f'{place}.source must be {", ".join(SOURCES)}; instead received {source!r}')
        bounds = [bound for bound in _BOUNDS if bound in limit]
        if not bounds:
            raise SuiteError(f'{place} must have {" or ".join(_BOUNDS)}')
        for bound in bounds:
            yield Limit(measure, bound, _number(f'{place}.{bound}', limit[bound]), source, reason, common)


def _mapping(place: str, entry: Any, known: Collection[str] = ()) -> Mapping[str, Any]:
    if not isinstance(entry, Mapping):
        keys = f' with {", ".join(known)}' if known else ''
        raise SuiteError(f'{place} must be a mapping{keys}; instead received {entry!r:.60}')
    for key in entry if known else ():
        _check_key(place, key, known, 'key')
    return entry


def _check_key(place: str, key: str, known: Collection[str], what: str) -> None:
    try:
        check_name(place, key, known)
    except ParameterError as error:
        raise SuiteError(str(error).replace('is no parameter of', f'is no {what} of')) from None


def _number(place: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or value != value:
        raise SuiteError(f'{place} must be a number; instead received {value!r}')
    return float(value)


def _text(place: str, value: Any) -> str:
    if not isinstance(value, str) or not value.strip():
        raise SuiteError(f'{place} must be a text; instead received {value!r}')
    return ' '.join(value.split())
