"""Types of the exported C: those of numbers are C's own names, the others are here.

A record is laid out as its numpy type, float64 and int64 without gaps: C and Python share its bytes.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple, get_type_hints

import numpy as np

from mount_models.quantity import quantities

FLOAT, WHOLE, TRUTH = 'double', 'int64_t', 'bool'
RECORD, MEMORY = 'record', 'memory'
_OF_KIND = {'f': FLOAT, 'i': WHOLE}


class Array(NamedTuple):
    """An array of float64 (n,); `kind` is `constants` where it is only read, else `array`."""

    kind: str


class Pointer(NamedTuple):
    """A pointer to a record, `seen` as `RECORD`, as `MEMORY`, or as a row of numbers FLOAT or WHOLE."""

    dtype: np.dtype
    constant: bool
    seen: str

    @property
    def length(self) -> int:
        """How many numbers the record has."""
        return self.dtype.itemsize // 8

    def field(self, name: str) -> Any:
        """Return the type of a field; raises `KeyError` without one of this name."""
        dtype = self.dtype[name]
        return Pointer(dtype, self.constant, RECORD) if dtype.names else _OF_KIND[dtype.kind]


class Tables(NamedTuple):
    """The named tuple of both tables."""

    policy: Array = Array('constants')
    current: Array = Array('constants')


Type = Any
"""A name of C's own, one of these classes, or a plain tuple of such for several values."""


class Declarations:
    """The C types that a translation needs, each once: `records` for the header, `values` beside."""

    def __init__(self) -> None:
        self.records: list[str] = []
        self.values: list[str] = []
        self._names: dict[Any, str] = {}

    def declare(
        self,
        dtype: np.dtype,
        name: str,
        kind: Any = None,
        comments: Mapping[str, str] | None = None,
        memory: bool = False,
    ) -> None:
        """Declare a record and those in it, and where a function views its `memory` also a union.

        `kind` is its named tuple, `comments` are those of fields.
        """
        hints, notes = (get_type_hints(kind), quantities(kind)) if kind else ({}, {})
        known = {field: f'{note.unit}, {note.limits}: {note.meaning}' for field, note in notes.items()}
        lines = []
        for field, (inner, *_) in (dtype.fields or {}).items():
            if inner.names and inner not in self._names:
                self.declare(inner, f'{name}_{field}', hints.get(field))
            text = {**known, **(comments or {})}.get(field)
            own = self._names[inner] if inner.names else _OF_KIND[inner.kind]
            lines.append(f'    {own} {field};' + (f' /**< {text} */' if text else ''))
        self._names[dtype] = f'engine_mount_{name}_t'
        about = comment(kind.__doc__) if kind and kind.__name__ != name else ''
        self.records.append(
            f'{about}typedef struct {{\n' + '\n'.join(lines) + f'\n}} {self._names[dtype]};\n'
        )
        if memory:
            rows = f'double numbers[{dtype.itemsize // 8}];\n    int64_t bits[{dtype.itemsize // 8}];'
            self.records.append(
                f'/** Its numbers in a row, and their bits. */\ntypedef union {{\n    '
                f'{self._names[dtype]} record;\n    {rows}\n}} engine_mount_{name}_memory_t;\n'
            )

    def name(self, kind: Type) -> str:
        """Return the C type; that of several values is declared when it is first asked for."""
        if isinstance(kind, str):
            return kind
        if isinstance(kind, Tables):
            return 'engine_mount_tables_t'
        if isinstance(kind, Array):
            return f'engine_mount_{kind.kind}_t'
        if isinstance(kind, Pointer):
            name = self._names[kind.dtype]
            name = name if kind.constant or kind.seen == RECORD else f'{name[:-2]}_memory_t'
            return f'{"const " if kind.constant else ""}{name} *'
        if kind not in self._names:
            self._names[kind] = f'engine_mount_values_{len(self.values) + 1}_t'
            fields = ''.join(f'    {self.name(each)} v{place};\n' for place, each in enumerate(kind))
            self.values.append(f'typedef struct {{\n{fields}}} {self._names[kind]};\n')
        return self._names[kind]


def comment(text: str) -> str:
    """Return a text of lines as a C comment that documents what follows."""
    return '\n'.join(['/**', *(f' * {line.strip()}'.rstrip() for line in text.strip().split('\n')), ' */\n'])
