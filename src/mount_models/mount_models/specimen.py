"""A specimen: everything the controller knows of one particular actuator, as one checked file.

A specimen is what a calibration has measured and what is known by design. It holds no truth of the
simulated plant; two mounts of one car have two specimens.
"""

import functools
import math
import types
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, get_args, get_origin, get_type_hints

from mount_models.actuator import ForceLaw, check_force_law
from mount_models.coil.copper import CoilHeating, check_heating
from mount_models.coil.correction import Bridge, TemperatureCompensation, check_compensation
from mount_models.coil.gap import GapCurves, check_gap_curves
from mount_models.friction.coefficient import FrictionCoefficients
from mount_models.friction.contact import FrictionContact, check_friction
from mount_models.plain_yaml import YamlError, excerpt, plain_yaml, text_of_file
from mount_models.quantity import Quantity, check_name, check_range, quantities
from mount_models.sampling import HIGHEST_CURRENT

SCHEMA_VERSION = 2
"""Number of the form of specimen files; 2 since they hold a temperature compensation."""

DEFAULT_SPECIMEN = Path(__file__).resolve().parent / 'specimens' / 'default.yaml'


class SpecimenError(ValueError):
    """A specimen is incomplete, of the wrong kind or outside its limits; the text says where."""


@dataclass(frozen=True)
class Specimen:
    """One actuator with its coil, springs and pads, as the controller knows it; SI units throughout.

    `friction` holds what was identified of `FrictionCoefficients` and `FrictionContact`, by their names; what
    is not in it keeps its default. Without `temperature` the gap curves hold at one temperature only; a file
    without `heating` or `bridge` has their defaults.
    """

    name: str
    force_law: ForceLaw
    gap_curves: GapCurves
    turns_area: Annotated[float, Quantity('m^2', 'turns times core area, forms L_i = n A dB/di', 1e-5, 10.0)]
    spring_stiffness: Annotated[float, Quantity('N/m', 'stiffness k_s of both halves', 1e3, 1e7)]
    pad_stiffness: Annotated[float, Quantity('N/m', 'stiffness k_p of the pads in contact', 5e6, 1e10)]
    rest_current: Annotated[
        float, Quantity('A', 'current at which the rest gap is measured', 0.01, 1.0, 'section 3.2')
    ] = 0.2
    crossing_inductance: Annotated[
        float, Quantity('H', 'inductance at which the contact gap is measured', 1e-3, 1.0, 'section 3.2')
    ] = 20e-3
    current_limit: Annotated[
        float, Quantity('A', 'largest current of the coil', 0.1, 20.0, 'section 3.2')
    ] = HIGHEST_CURRENT
    coil_resistance: Annotated[
        float | None, Quantity('ohm', 'resistance of the coil at 20 degC', 0.01, 100.0)
    ] = None  # None: not known, so not held against the ripple
    temperature: TemperatureCompensation | None = None
    heating: CoilHeating = field(default_factory=CoilHeating)
    bridge: Bridge = field(default_factory=Bridge)
    friction: dict[str, float] = field(default_factory=dict)
    provenance: dict[str, Any] = field(default_factory=dict)


def default_specimen() -> Specimen:
    """Return the specimen that `make identify` measured on the simulated rack."""
    return load_specimen(DEFAULT_SPECIMEN)


def load_specimen(path: str | Path, name: str = '') -> Specimen:
    """Return the specimen in the YAML file `path`; every doubt raises `SpecimenError` and names the entry.

    With a `name`, a file for another specimen is refused. Who loads the same content twice gets the same
    object.
    """
    try:
        specimen = _specimen_in(text_of_file(Path(path)))
    except YamlError as error:
        raise SpecimenError(f'specimen file {path} {error}') from error
    except SpecimenError as error:
        raise SpecimenError(f'specimen file {path}: {error}') from error
    if name and specimen.name != name:
        raise SpecimenError(
            f'specimen file {path} is for the specimen {specimen.name!r}, {name!r} is asked for; give the '
            f'file of {name!r}, or ask for {specimen.name!r}'
        )
    return specimen


def chosen_specimen(parameters_file: str, name: str = '') -> Specimen:
    """Return the specimen in `parameters_file`, or the default one if that is empty.

    With a `name`, another specimen than that is refused; raises `SpecimenError`.
    """
    return load_specimen(parameters_file or DEFAULT_SPECIMEN, name)


def friction_coefficients(friction: Mapping[str, float]) -> FrictionCoefficients:
    """Return the coefficients that a specimen's `friction` gives; what is not in it keeps its default."""
    return _named_in(friction, FrictionCoefficients)


def friction_contact(friction: Mapping[str, float]) -> FrictionContact:
    """Return the contact that a specimen's `friction` gives; what is not in it keeps its default."""
    return _named_in(friction, FrictionContact)


def specimen_from_mapping(content: Any) -> Specimen:
    """Return the checked specimen described by plain dictionaries and lists, or raise `SpecimenError`."""
    hints = get_type_hints(Specimen)
    _check_version(content)
    if isinstance(content, Mapping):
        content = {**_OPTIONAL, **content}
    values = _complete(content, ['schema_version', *hints], 'specimen')
    return checked_specimen(
        Specimen(**{name: _converted(values[name], kind, name) for name, kind in hints.items()})
    )


def checked_specimen(specimen: Specimen) -> Specimen:
    """Return `specimen` if all values agree with their limits and each other, or raise `SpecimenError`."""
    try:
        _check(specimen)
    except SpecimenError:
        raise
    except ValueError as error:
        raise SpecimenError(str(error)) from error
    return specimen


def _check(specimen: Specimen) -> None:
    for where, part in {'': specimen, **{f'{name}.': getattr(specimen, name) for name in _PARTS}}.items():
        for name, quantity in quantities(type(part)).items():
            value = getattr(part, name)
            if isinstance(value, (int, float)):
                check_range(f'{where}{name}', value, quantity)
    known = {**quantities(FrictionCoefficients), **quantities(FrictionContact)}
    for name, value in specimen.friction.items():
        check_name('friction', name, known)
        check_range(f'friction.{name}', value, known[name])
    check_force_law(specimen.force_law)
    check_gap_curves(specimen.gap_curves)
    if specimen.temperature is not None:
        check_compensation(specimen.temperature, specimen.gap_curves)
    check_heating(specimen.heating)
    check_friction(friction_coefficients(specimen.friction), friction_contact(specimen.friction))
    bridge = specimen.bridge
    if not bridge.lowest_voltage <= bridge.link_voltage <= bridge.highest_voltage:
        raise SpecimenError(
            f'bridge.link_voltage ({bridge.link_voltage:g} V) must lie within lowest_voltage .. '
            f'highest_voltage ({bridge.lowest_voltage:g} .. {bridge.highest_voltage:g} V); correct the range'
        )
    if specimen.coil_resistance not in (None, specimen.heating.resistance):
        raise SpecimenError(
            f'coil_resistance ({specimen.coil_resistance:g} ohm) and heating.resistance '
            f'({specimen.heating.resistance:g} ohm) are those of one coil at 20 degC: correct one of them'
        )
    if specimen.current_limit > specimen.force_law.current_high:
        raise SpecimenError(
            f'current_limit ({specimen.current_limit:.2f} A) must not exceed force_law.current_high '
            f'({specimen.force_law.current_high:.2f} A); lower it, or calibrate up to it'
        )
    parts = _mapping(specimen.provenance.get('parts', {}), 'provenance.parts')
    for name, part in parts.items():
        _text(_mapping(part, f'provenance.parts.{name}').get('specimen'), f'provenance.parts.{name}.specimen')


_PARTS = ('force_law', 'temperature', 'heating', 'bridge')
_OPTIONAL = {  # not in calibrations of before
    'coil_resistance': None,
    'heating': CoilHeating()._asdict(),
    'bridge': Bridge()._asdict(),
}


# Several parts of a run load the same file, and to check it takes some 20 ms.
@functools.lru_cache(maxsize=8)
def _specimen_in(text: str) -> Specimen:
    return specimen_from_mapping(plain_yaml(text))


def _check_version(content: Any) -> None:
    version = content.get('schema_version') if isinstance(content, Mapping) else SCHEMA_VERSION
    if version != SCHEMA_VERSION:
        raise SpecimenError(
            f'schema_version ({excerpt(version)}) must be {SCHEMA_VERSION}; the file is of another version '
            'of this software, or none of its specimens: calibrate again'
        )


def _named_in(values: Mapping[str, float], kind: Any) -> Any:
    return kind(**{name: value for name, value in values.items() if name in kind._fields})


def _complete(content: Any, names: list[str], where: str) -> dict[str, Any]:
    """Return `content` if it is a mapping with exactly these names."""
    content = _mapping(content, where)
    missing = [name for name in names if name not in content]
    unknown = [str(name) for name in content if name not in names]
    if missing or unknown:
        fault = f'{missing[0]} is missing' if missing else f'{unknown[0]} is unknown'
        raise SpecimenError(
            f'{where} must hold exactly {", ".join(names)}; {fault}: correct it or calibrate again'
        )
    return content


def _mapping(value: Any, where: str) -> dict[str, Any]:
    if not isinstance(value, Mapping):
        raise SpecimenError(
            f'{where} must be a mapping of names to values; instead received {excerpt(value)}'
        )
    return dict(value)


def _converted(value: Any, kind: Any, where: str) -> Any:
    """Return `value` from a file as the declared `kind`."""
    if get_origin(kind) is types.UnionType:
        return None if value is None else _converted(value, get_args(kind)[0], where)
    if kind is str:
        return _text(value, where)
    if get_origin(kind) is dict:
        of = get_args(kind)[1]
        return {
            name: part if of is Any else _number(part, f'{where}.{name}')
            for name, part in _mapping(value, where).items()
        }
    if get_origin(kind) is tuple:
        if not isinstance(value, (list, tuple)) or not value:
            raise SpecimenError(f'{where} must be a list of numbers; instead received {excerpt(value)}')
        return tuple(_number(part, f'{where}[{k}]') for k, part in enumerate(value))
    if kind is float:
        return _number(value, where)
    hints = get_type_hints(kind)
    parts = _complete(value, list(hints), where)
    return kind(**{name: _converted(parts[name], hint, f'{where}.{name}') for name, hint in hints.items()})


def _text(value: Any, where: str) -> str:
    if not isinstance(value, str) or not value:
        raise SpecimenError(f'{where} must be a text; instead received {excerpt(value)}')
    return value


def _number(value: Any, where: str) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        remedy = ' (YAML reads 1e-6 as a text: write 1.0e-6)' if isinstance(value, str) else ''
        raise SpecimenError(f'{where} must be a finite number; instead received {excerpt(value)}{remedy}')
    return float(value)
