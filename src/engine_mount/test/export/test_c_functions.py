"""What the walk over syntax trees refuses, each with file and line, instead of guessing."""

import math

import numpy as np
import pytest

from engine_mount.export.c_functions import Unit, UntranslatableError
from engine_mount.export.c_types import FLOAT, RECORD, WHOLE, Array, Declarations, Pointer

RECORD_TYPE = np.dtype([('height', 'f8'), ('count', 'i8')])


def written(record):
    record.height += 1.0
    return record.height


def call_amid_others(record):
    return record.height + written(record)


def call_in_the_second_place(record):
    return record.height > 0.0 and written(record) > 0.0


def whole_of_a_float(record):
    record.count = 0.5 * record.height


def unknown_function(record):
    return math.sin(record.height)


def unknown_statement(record):
    assert record.height > 0.0


def loop_over_values(record):
    for value in (1.0, 2.0):
        record.height = value


def loop_with_a_later_use(record):
    for place in range(3):
        record.count = place
    return place


def power(record):
    return record.height**3


def two_types(record):
    name = record
    if record.height > 0.0:
        name = 1.0
    return name


def recursion(record):
    return recursion(record)


@pytest.mark.parametrize(
    'function',
    [
        call_amid_others, call_in_the_second_place, whole_of_a_float, unknown_function, unknown_statement,
        loop_over_values, loop_with_a_later_use, power, two_types,
    ],
)  # fmt: skip
def test_what_no_law_has_is_refused_with_file_and_line(function):
    first = function.__code__.co_firstlineno
    with pytest.raises(UntranslatableError) as refused:
        translated(function)
    line = int(str(refused.value).split('.py:')[1].split(':')[0])
    assert str(refused.value).startswith(f'{__file__}:')
    assert first < line < first + 5


def test_recursion_is_refused():
    with pytest.raises(UntranslatableError, match='recursion calls itself'):
        translated(recursion)


def translated(function) -> str:
    types = Declarations()
    types.declare(RECORD_TYPE, 'record')
    unit = Unit(types)
    unit.translated(function, [Pointer(RECORD_TYPE, False, RECORD)])
    return unit.functions[-1]


def read_before(record):
    record.height, record.count = 2.0 * record.height, record.count + 1
    return written(record) - record.height


def test_values_are_known_before_the_first_target_changes_and_calls_come_first():
    lines = [line.strip() for line in translated(read_before).splitlines()]
    assert lines[lines.index('value_1 = 2.0 * record->height;') :][:7] == [
        'value_1 = 2.0 * record->height;',
        'value_2 = record->count + INT64_C(1);',
        'record->height = value_1;',
        'record->count = value_2;',
        'value_3 = engine_mount_law_test_c_functions_written(record);',
        'return value_3 - record->height;',
        '}',
    ]


def keyword(double, array):
    return array[double] if double > 0 else 0.0


def test_a_name_that_c_has_itself_gets_another():
    unit = Unit(Declarations())
    unit.translated(keyword, [WHOLE, Array('constants')])
    assert '(int64_t double_, engine_mount_constants_t array)' in unit.functions[0]
    assert unit.translated(keyword, [WHOLE, Array('constants')]).result == FLOAT
