"""The controller as two files of C: translated functions, the numbers of a law, and their surroundings."""

import re
from importlib.resources import files
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from engine_mount.export.c_functions import Unit, literal
from engine_mount.export.c_types import FLOAT, MEMORY, WHOLE, Array, Declarations, Pointer, Tables
from engine_mount.settings.chosen import Parameters, chosen_control, chosen_specimen, policy_of
from mount_control.control_loop import ControlLoop, missing_samples
from mount_control.controller import ControlLaw
from mount_control.force_maker import FORCE_STEP, CurrentTable, fill_table, places_of, table_fault
from mount_control.policy.contract import trace_fields
from mount_control.settings import ControlSettings
from mount_models.arithmetic.record import record_dtype
from mount_models.friction.contact import HIGHEST_NORMAL_FORCE
from mount_models.quantity import quantities
from mount_models.sampling import sample_time_ns
from mount_recorder.versions import versions

NAME = 'engine_mount_controller'
SELF_TEST_SAMPLES = 2000  # chosen: gaps, a change of the law and displacements out of range are among them
_WITHOUT_EFFECT = {'displacement_velocity', 'displacement_noise', 'displacement_stuck', 'shadow'}
_TABLE_PLACES = int(HIGHEST_NORMAL_FORCE / FORCE_STEP)
_TEST_FORCES = (0.0, 20.0, 60.0, 120.0, 250.0)  # N, chosen
_TEST_SHARES = (0.1, 0.3, 0.5, 0.8, 1.0)  # chosen, of the highest current


class LawNumbers(NamedTuple):
    """The fields of `engine_mount_controller_law_t`: record and table of a law, and limits of its samples."""

    numbers: np.void
    table: np.ndarray
    window: int
    period: int
    longest_bridge: int
    displacement_range: float


def law_numbers(settings: ControlSettings) -> LawNumbers:
    """Return a law in numbers, without the offset current, which comes with the table."""
    law, parameters = ControlLaw(settings, _test_table(settings)), settings.parameters
    numbers = law.record.view(record_dtype(law.compiled.law))[0]
    numbers.maker.limits.offset_current = 0.0
    return LawNumbers(
        numbers,
        law.tables.policy,
        law.window.size,
        sample_time_ns(parameters.sample_rate),
        round(1e9 * parameters.longest_bridge),
        parameters.displacement_range,
    )


def write_controller(parameters: Parameters, folder: Path) -> list[Path]:
    """Write `engine_mount_controller.h` and `.c` for {node: {parameter: value}}; return both paths.

    Raises a `ValueError` for parameters that cannot be, and for a law that cannot be translated.
    """
    folder.mkdir(parents=True, exist_ok=True)
    written = [folder / f'{NAME}{suffix}' for suffix in ('.h', '.c')]
    for path, text in zip(written, _sources(parameters), strict=True):
        path.write_text(text, encoding='utf-8')
    return written


def sequence_hash(settings: ControlSettings, samples: int) -> int:
    """Return what `engine_mount_controller_sequence_hash` returns in C, from the controller in Python."""
    unlimited = settings.parameters._replace(
        displacement_velocity=np.inf, displacement_noise=np.inf, displacement_stuck=1e9
    )
    loop, settings = ControlLoop(), settings._replace(parameters=unlimited)
    loop.measured_before = True
    loop.begin(settings, _test_table(settings), 0)
    assert loop.controller is not None
    trace = loop.controller.trace_record.view(np.uint64)
    period = sample_time_ns(settings.parameters.sample_rate)
    stamp, random, hashed = 0, 1, 14695981039346656037  # of FNV-1a, and its factor below
    for n in range(samples):
        random, periods, displacement, frequency, event = built_in_sample(n, random)
        stamp += periods * period
        if event == 1:
            loop.change(settings)
        if event == 2:
            loop.controller.counts[0] = 0x7FF8000000000000
        if loop.step(stamp, displacement, frequency) is not None and loop.trace is None:
            loop.controller.step(displacement, 0, frequency)
        for number in trace.tolist():
            hashed = (hashed ^ number) * 1099511628211 % 2**64
    return hashed


def built_in_sample(n, random):
    """Return the new random number, periods since the last sample, m, Hz of the crankshaft, event.

    At 1 kHz sample `n` sways at 8 Hz, and hardly for a quarter of the time; 1.5 m is out of every range.
    The Hz rise, and are not known for a third of the time: 0 or less. Event 1 is a change of the law, event 2
    a memory that becomes NaN.
    """
    random = (random * 1103515245 + 12345) % 2147483648
    place = n % 125
    wave = (place if place < 63 else 125 - place) - 31
    displacement = (wave if n % 4000 < 3000 else wave // 10) * 4e-5 + (random // 65536 - 16384) * 2e-10
    if n % 997 == 996:
        displacement = 1.5
    periods = 4 if n % 499 == 498 else 200 if n % 1999 == 1998 else 1
    event = 1 if n % 1501 == 1500 else 2 if n % 1201 == 1200 else 0
    frequency = (n % 600 - 200) * 0.1
    return random, periods, displacement, frequency, event


def _test_table(settings: ControlSettings) -> CurrentTable:
    currents = [share * settings.parameters.highest_current for share in _TEST_SHARES]
    return settings.table(currents, _TEST_FORCES, currents[0])


def _sources(parameters: Parameters) -> tuple[str, str]:
    """Return header and source."""
    settings = chosen_control(parameters)
    compiled = ControlLaw(settings, _test_table(settings)).compiled
    types = Declarations()
    dtypes = record_dtype(compiled.law), compiled.state, compiled.trace
    types.declare(dtypes[0], 'law', compiled.law)
    types.declare(dtypes[1], 'state', memory=True)
    types.declare(dtypes[2], 'trace', comments=trace_fields(settings.policy), memory=True)
    law, state, trace = (Pointer(dtype, dtype is dtypes[0], MEMORY) for dtype in dtypes)
    array, constants = Array('array'), Array('constants')
    tables, unit = Tables(), Unit(types)
    for function, arguments in (
        (compiled.start, (law, tables, state, array, FLOAT)),
        (compiled.transfer, (law, law, state, array, array)),
        (compiled.step, (law, tables, state, array, trace, FLOAT, WHOLE, FLOAT)),
        (table_fault, (constants, constants, FLOAT, FLOAT)),
        (places_of, (constants,)),
        (fill_table, (array, constants, constants)),
        (missing_samples, (WHOLE, WHOLE)),
        (built_in_sample, (WHOLE, WHOLE)),
    ):
        sample = unit.translated(function, arguments)
    highest = settings.parameters.highest_current
    functions = '\n'.join(unit.functions)
    words: dict[str, object] = {
        'VERSION': versions()['mount_bringup'],
        'SPECIMEN': chosen_specimen(parameters, 'mount_control').name,
        'SAMPLE': types.name(sample.result),
        'POLICY': settings.parameters.policy,
        'PARAMETERS': _parameter_lines(settings, parameters),
        'RECORDS': '\n'.join(types.records),
        'VALUES': '\n'.join(types.values),
        'FUNCTIONS': functions,
        'HELPERS': _helpers(functions),
        'LAW': _law(law_numbers(settings)),
        'TABLE_PLACES': _TABLE_PLACES,
        'FORCE_STEP': f'{FORCE_STEP:g}',
        'WINDOW': _longest_window(parameters),
        'STATE_NUMBERS': state.length,
        'TRACE_NUMBERS': trace.length,
        'SELF_TEST_SAMPLES': SELF_TEST_SAMPLES,
        'TEST_CURRENTS': ', '.join(repr(share * highest) for share in _TEST_SHARES),
        'TEST_FORCES': ', '.join(map(repr, _TEST_FORCES)),
        'HASH': sequence_hash(settings, SELF_TEST_SAMPLES),
    }
    header, source = (
        re.sub('@([A-Z_]+)@', lambda match: str(words[match[1]]), _template(f'{NAME}{suffix}'))
        for suffix in ('.h', '.c')
    )
    return header, source


def _template(name: str) -> str:
    return files('engine_mount.export').joinpath(f'{name}.in').read_text(encoding='utf-8')


def _helpers(functions: str) -> str:
    """Return those helpers that the functions need, each before those that need it."""
    needed: list[str] = []
    for helper in reversed(_template('helpers.c').split('\n\n')):
        name = re.search(r'engine_mount_\w+(?=\()', helper)
        if name and re.search(rf'\b{name[0]}\(', '\n'.join([functions, *needed])):
            needed.insert(0, helper.rstrip('\n') + '\n')
    return '\n'.join(needed)


def _parameter_lines(settings: ControlSettings, parameters: Parameters) -> str:
    rows: list[Any] = [settings.parameters, policy_of(parameters)[1], settings.friction, settings.contact]
    lines = (
        f' *   {name} {getattr(each, name)} {quantity.unit} ({quantity.limits}): {quantity.meaning}'
        for each in rows
        for name, quantity in quantities(each).items()
        if name not in _WITHOUT_EFFECT
    )
    return '\n'.join(line.replace('*/', '* /').replace('/*', '/ *') for line in lines)


def _longest_window(parameters: Parameters) -> int:
    """Return the most numbers that the policy remembers with one of its parameters at an end of its range."""
    policy, own = policy_of(parameters)
    sample_time = 1.0 / chosen_control(parameters).parameters.sample_rate
    longest = policy.design(own, sample_time).window
    for name, quantity in quantities(own).items():
        for limit in (quantity.low, quantity.high) if isinstance(getattr(own, name), float) else ():
            try:
                longest = max(longest, policy.design(own._replace(**{name: limit}), sample_time).window)
            except ValueError:
                continue  # no law has this value beside the others
    return max(longest, 1)


def _law(law: LawNumbers) -> str:
    """Return the constant that holds a law."""
    table = ',\n    '.join(literal(each).text for each in law.table) or '0.0'
    return f"""static const double engine_mount_law_table[{max(law.table.size, 1)}] = {{
    {table}
}};

const engine_mount_controller_law_t engine_mount_controller_law = {{
    .numbers = {_record(law.numbers, '        ')},
    .table = engine_mount_law_table,
    .table_size = INT64_C({law.table.size}),
    .window = INT64_C({law.window}),
    .period = INT64_C({law.period}),
    .longest_bridge = INT64_C({law.longest_bridge}),
    .displacement_range = {law.displacement_range!r}
}};
"""


def _record(record: Any, indent: str) -> str:
    lines = []
    for name in record.dtype.names:
        value = record[name]
        text = _record(value, f'{indent}    ') if value.dtype.names else literal(value).text
        lines.append(f'{indent}.{name} = {text}')
    return '{\n' + ',\n'.join(lines) + f'\n{indent[4:]}}}'
