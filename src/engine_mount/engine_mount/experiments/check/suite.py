"""The suite: manoeuvres with their limits, from one YAML file; verdicts on their figures."""

import importlib.resources
import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from engine_mount.experiments.harness.experiment import Settings, in_one_line
from mount_bringup.settings import checked_settings
from mount_models.plain_yaml import YamlError, plain_yaml, text_of_file
from mount_models.quantity import ParameterError, check_name

BANDS = ((3.0, 14.0), (14.0, 20.0), (20.0, 30.0), (30.0, 50.0), (20.0, 200.0))
"""Hz: resonance of the engine; the isolation bands of the sweep; what the chassis passes on as sound."""
ROAD, RACK = 'road', 'rack'
SOURCES = ('contract', 'derived', 'paper', 'chosen')
"""Where the number of a limit comes from; `chosen` ones are a decision of whoever wrote the suite."""
_BOUNDS = ('at_most', 'at_least')
_NODES = ('mount_sim', 'mount_control', 'mount_init', 'mount_driver')
_LONGEST_NAME = 10  # characters: the table of verdicts fits 80 columns
NOT_JUDGED, FAILED, PASSED = 'not judged', 'fail', 'ok'
"""Of a limit, the worst first: its manoeuvre broke down; exceeded; held."""
_ORDER = (NOT_JUDGED, FAILED, PASSED)


class SuiteError(ValueError):
    """A suite cannot be used; the text says where, why and the remedy."""


class Measure(NamedTuple):
    """The unit of a number ('' for counts and ratios), its meaning, and on which seats it is known."""

    unit: str
    meaning: str
    seats: str


def _shipped(file: str) -> Any:
    """Return the content of a YAML file beside this module."""
    return plain_yaml(importlib.resources.files(__package__).joinpath(file).read_text(encoding='utf-8'))


MEASURES = {name: Measure(*entry) for name, entry in _shipped('measures.yaml').items()}
"""{name: what it means}. A number that is not known is exceeded, whatever its limit."""


class Limit(NamedTuple):
    """A bound of a measure: `at_most` or `at_least` so much, and where that comes from.

    A `common` one is shared with all manoeuvres of the suite.
    """

    measure: str
    bound: str
    value: float
    source: str
    reason: str
    common: bool


class Manoeuvre(NamedTuple):
    """A drive with limits: {node: {parameter: value}}, looked at from so many s of excitation on."""

    name: str
    about: str
    evaluated_from: float
    settings: Settings
    limits: Sequence[Limit] = ()

    @property
    def seat(self) -> str:
        """`RACK` where the displacement is imposed, else `ROAD`."""
        return RACK if self.settings['mount_sim']['scenario'] == 'bench' else ROAD


class Result(NamedTuple):
    """The figures of a manoeuvre by the names of their measures, and what was not as it should be.

    `broke_down`: why there are no figures, empty where there are.
    """

    figures: Mapping[str, float]
    remarks: Sequence[str] = ()
    broke_down: str = ''


class Verdict(NamedTuple):
    """One figure against one limit; `margin` is the share that is left of it, NaN of a limit of 0."""

    manoeuvre: str
    limit: Limit
    value: float
    judged: str
    margin: float


def verdicts_of(manoeuvre: Manoeuvre, result: Result) -> list[Verdict]:
    """Return the verdicts on one manoeuvre in the order of its limits."""
    verdicts = []
    for limit in manoeuvre.limits:
        value = result.figures.get(limit.measure, math.nan)
        left = limit.value - value if limit.bound == 'at_most' else value - limit.value
        # a value that is not known fails
        judged = NOT_JUDGED if result.broke_down else PASSED if left >= 0.0 else FAILED
        margin = left / abs(limit.value) if limit.value else math.nan
        verdicts.append(Verdict(manoeuvre.name, limit, value, judged, margin))
    return verdicts


def worst_first(verdicts: Sequence[Verdict]) -> list[Verdict]:
    """Return the verdicts with those that failed first, then by the margin that is left."""

    def key(verdict: Verdict) -> tuple[int, float]:
        unknown = -math.inf if verdict.judged == FAILED else math.inf
        return _ORDER.index(verdict.judged), unknown if math.isnan(verdict.margin) else verdict.margin

    return sorted(verdicts, key=key)


def passed(verdicts: Sequence[Verdict]) -> bool:
    """Return whether every limit was judged and held."""
    return all(verdict.judged == PASSED for verdict in verdicts)


def shipped_suite() -> list[Manoeuvre]:
    """Return the manoeuvres that come with the package."""
    return suite_of(_shipped('suite.yaml'))


def suite_in_file(file: Path) -> list[Manoeuvre]:
    """Return the manoeuvres of a file; raises `SuiteError` with its name."""
    try:
        return suite_of(plain_yaml(text_of_file(file)))
    except (YamlError, SuiteError) as error:
        raise SuiteError(f'suite {file}: {error}') from None


def suite_of(content: Any) -> list[Manoeuvre]:
    """Return the manoeuvres of a suite's content; raises `SuiteError`."""
    suite = _mapping('the suite', content, ('about', 'limits', 'manoeuvres'))
    common = list(_limits('limits', suite.get('limits', {}), common=True))
    manoeuvres = _mapping('manoeuvres', suite.get('manoeuvres'))
    if not manoeuvres:
        raise SuiteError('manoeuvres must name at least one manoeuvre')
    return [_manoeuvre(name, entry, common) for name, entry in manoeuvres.items()]


def chosen_of(suite: Sequence[Manoeuvre], names: Collection[str]) -> list[Manoeuvre]:
    """Return the manoeuvres of these names in the order of the suite, all without names."""
    for name in names:
        _check_key('the suite', name, [each.name for each in suite], 'manoeuvre')
    return [each for each in suite if not names or each.name in names]


def _manoeuvre(name: str, entry: Any, common: Sequence[Limit]) -> Manoeuvre:
    if len(name) > _LONGEST_NAME:
        raise SuiteError(f'{name}: a name has at most {_LONGEST_NAME} characters, this one {len(name)}')
    keys = _mapping(name, entry, ('about', 'evaluated_from_s', 'set', 'limits'))
    begin = _number(f'{name}.evaluated_from_s', keys.get('evaluated_from_s', 0.0))
    if begin < 0.0:
        raise SuiteError(f'{name}.evaluated_from_s ({begin:g} s) must be 0 or more')
    about = _text(f'{name}.about', keys.get('about'))
    settings: dict[str, dict[str, Any]] = {}
    for key, value in _mapping(f'{name}.set', keys.get('set')).items():
        node, _, parameter = key.partition('.')
        _check_key(f'{name}.set', node, _NODES, 'node')
        settings.setdefault(node, {})[parameter] = value
    try:
        settings = checked_settings(settings)
    except ParameterError as error:
        raise SuiteError(f'{name}.set: {error}') from None
    if 'scenario' not in settings.get('mount_sim', {}):
        raise SuiteError(f'{name}.set must have mount_sim.scenario, such as motorway')
    seat = Manoeuvre(name, about, begin, settings).seat
    own = list(_limits(name, keys.get('limits', {})))
    for limit in own:
        if seat not in MEASURES[limit.measure].seats:
            raise SuiteError(f'{name}: {limit.measure} cannot be told on a {seat}; leave it out')
    shared = [limit for limit in common if seat in MEASURES[limit.measure].seats]
    return Manoeuvre(name, about, begin, settings, [*own, *shared])


def _limits(name: str, entry: Any, *, common: bool = False) -> Iterator[Limit]:
    for measure, content in _mapping(name, entry).items():
        _check_key(name, measure, MEASURES, 'quantity')
        place = f'{name}.{measure}'
        limit = _mapping(place, content, (*_BOUNDS, 'source', 'reason'))
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
    return in_one_line(value)
