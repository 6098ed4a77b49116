"""Compiled Python functions translated to C, statement by statement, from their own syntax trees.

Only what the laws use is known; everything else is refused with file and line. The order of evaluation stays
Python's: a call that writes into memory must be the first part of its statement, and becomes its own one. An
index beyond an array reads NaN and writes nothing, so a spoiled memory leads to the answer to NaN: 0 A.
"""

import ast
import inspect
import math
import textwrap
from collections.abc import Callable, Iterable, Sequence
from typing import Any, NamedTuple, NoReturn

import numpy as np

from engine_mount.export.c_types import (
    FLOAT,
    MEMORY,
    RECORD,
    TRUTH,
    WHOLE,
    Array,
    Declarations,
    Pointer,
    Tables,
    Type,
    comment,
)

_KEYWORDS = (
    'auto case char const default do double enum extern float goto inline int long register short signed '
    'sizeof static struct switch typedef union unsigned void volatile'
)
_SIGNS = {ast.Add: '+', ast.Sub: '-', ast.Mult: '*', ast.Div: '/', ast.And: '&&', ast.Or: '||',
          ast.Lt: '<', ast.LtE: '<=', ast.Gt: '>', ast.GtE: '>=', ast.Eq: '==', ast.NotEq: '!='}  # fmt: skip
_OF_WHOLE = {ast.FloorDiv: 'quotient', ast.Mod: 'remainder', ast.LShift: 'left', ast.RShift: 'right',
             ast.BitAnd: 'common_bits'}  # fmt: skip
_OF_FLOAT = {
    math.sqrt: ('root', FLOAT), np.rint: ('rint', FLOAT),
    math.isnan: ('isnan', TRUTH), math.isfinite: ('isfinite', TRUTH),
}  # fmt: skip
_ROWS = {FLOAT: 'numbers', WHOLE: 'bits'}


class UntranslatableError(ValueError):
    """A statement cannot be translated; the text says which, where and why."""


class Text(NamedTuple):
    """An expression in C, and its type."""

    text: str
    type: Type


class Translated(NamedTuple):
    """A C function; `writes`: into memory of its caller."""

    name: str
    result: Type
    writes: bool


class Unit:
    """The C functions made so far, each before those that call it."""

    def __init__(self, declarations: Declarations):
        self.declarations = declarations
        self.functions: list[str] = []
        self._known: dict[Any, Translated | None] = {}

    def translated(self, function: Callable[..., Any], arguments: Iterable[Type]) -> Translated:
        """Return a Python function, compiled or not, as the C function for these types of arguments."""
        function = getattr(function, 'py_func', function)
        key = function.__code__, (arguments := tuple(arguments))
        if key not in self._known:
            self._known[key] = None
            alike = sum(code is function.__code__ for code, _ in self._known) - 1
            name = f'engine_mount_law_{function.__module__.rpartition(".")[2]}_{function.__name__.strip("_")}'
            self._known[key] = _Function(self, function, arguments, name + '_other' * alike).translate()
        if (known := self._known[key]) is None:
            raise UntranslatableError(f'{function.__qualname__} calls itself; a law must not')
        return known


class _Function:
    """One function: `_on_` methods write statements, `_text_` methods return expressions."""

    def __init__(self, unit: Unit, function: Any, arguments: Sequence[Type], name: str):
        self._unit, self._function, self._name = unit, function, name
        source, self._line = inspect.getsourcelines(function)
        module: Any = ast.parse(textwrap.dedent(''.join(source)))
        self._tree = module.body[0]
        self._names = [each for each in ast.walk(self._tree) if isinstance(each, ast.Name)]
        self._arguments = dict(zip((each.arg for each in self._tree.args.args), arguments, strict=True))
        self._types = dict(self._arguments)
        self._own = {each.id for each in self._names if isinstance(each.ctx, ast.Store)} | {*self._types}
        self._constants: dict[str, Any] = {}  # {local name: tuple of the module}
        self._result: Type = 'void'
        self._writes = False

    def translate(self) -> Translated:
        """Add the function to the unit; the types of local names settle within some passes."""
        before: Any = None
        while before != (before := ({**self._types}, self._result)):
            self._lines: list[str] = []
            self._depth = self._held = 0
            self._block(self._tree.body)
        kind = self._unit.declarations.name
        names = {name: f'{kind(each)} {_c_name(name)}' for name, each in self._types.items()}
        unused = {*self._arguments} - {each.id for each in self._names}
        lines = [f'    {names[name]};' for name in names if name not in self._arguments]
        lines += [f'    (void)({_c_name(name)});' for name in self._arguments if name in unused]
        about = f'{self._function.__module__}.{self._function.__name__}:\n{inspect.getdoc(self._function)}'
        head = (
            f'static {kind(self._result)} {self._name}({", ".join(names[each] for each in self._arguments)})'
        )
        body = '\n'.join(lines + self._lines)
        self._unit.functions.append(f'{comment(about)}{_wrapped(head, "")}\n{{\n{body}\n}}\n')
        return Translated(self._name, self._result, self._writes)

    def _refuse(self, node: Any, why: str = 'no law has such a statement') -> NoReturn:
        where = f'{self._function.__code__.co_filename}:{self._line + node.lineno - 1}'
        raise UntranslatableError(f'{where}: {ast.unparse(node)!r:.80} has no translation to C: {why}')

    # Statements.

    def _write(self, text: str) -> None:
        indent = '    ' * self._depth
        self._lines.append(_wrapped(text, indent))

    def _block(self, statements: Sequence[Any], first: str = '', last: str = '') -> None:
        if first:
            self._write(first)
        self._depth += 1
        for each in statements:
            late = isinstance(each, ast.AugAssign)  # the target is read first
            self._root = None if late else getattr(each, 'value', getattr(each, 'test', None))
            self._first = None if isinstance(each, ast.While) else _first(self._root)
            try:
                getattr(self, f'_on_{type(each).__name__.lower()}', self._refuse)(each)
            except (AttributeError, LookupError, NameError, TypeError) as error:
                self._refuse(each, f'no law has such a statement ({error})')
        self._depth -= 1
        if last:
            self._write(last)

    def _hold(self, value: Text) -> Text:
        """Write a value into a name of its own, and return that."""
        self._held += 1
        name = f'value_{self._held}'
        self._types[name] = value.type
        self._write(f'{name} = {_bare(value.text)};')
        return Text(name, value.type)

    def _on_expr(self, node: Any) -> None:
        if not isinstance(node.value, ast.Constant):  # a docstring
            value = self._text(node.value)
            self._write(f'{"" if value.type == "void" else "(void)"}{value.text};')

    def _on_return(self, node: Any) -> None:
        if node.value is None:
            return self._write('return;')
        value = self._text(node.value)
        self._result = value.type if self._result == 'void' else self._common(node, self._result, value.type)
        return self._write(f'return {_bare(self._as(node, value, self._result))};')

    def _on_if(self, node: Any) -> None:
        self._block(node.body, f'if ({_bare(self._truth(node.test))}) {{', '}')
        if node.orelse:
            self._lines[-1] += ' else {'
            self._block(node.orelse, '', '}')

    def _on_while(self, node: Any) -> None:
        self._block(node.body, f'while ({_bare(self._truth(node.test))}) {{', '}')

    def _on_for(self, node: Any) -> None:
        target, limits = node.target, node.iter.args
        inside = [each for each in ast.walk(node) if isinstance(each, ast.Name) and each.id == target.id]
        outside = len([each for each in self._names if each.id == target.id]) - len(inside)
        written = sum(isinstance(each.ctx, ast.Store) for each in inside)
        clear = target.id == '_' or (not outside and written == 1)
        if not clear or self._value(node.iter.func) is not range or len(limits) > 2:
            self._refuse(node, 'only range of one or two numbers is known, and a name used nowhere else')
        begin, end = [literal(0), *map(self._text, limits)][-2:]
        self._loop(target.id, begin.text, end, node.body)

    def _loop(self, name: str, begin: str, end: Text, body: Sequence[Any]) -> None:
        self._types[name], name = WHOLE, _c_name(name)
        limit = (end if end.text.startswith('INT64_C') else self._hold(end)).text
        self._block(body, f'for ({name} = {begin}; {name} < {limit}; {name} += INT64_C(1)) {{', '}')

    def _on_break(self, node: Any) -> None:
        self._write('break;')

    def _on_augassign(self, node: Any) -> None:
        value = self._arithmetic(node, node.op, self._text(node.target), self._text(node.value))
        self._store(node.target, value)

    def _on_assign(self, node: Any) -> None:
        target = node.targets[0]
        if not isinstance(target, ast.Tuple):
            value = self._text(node.value)
            if len(node.targets) > 1 and self._constant(node.value) is None:
                value = self._hold(value)
            for each in node.targets:
                self._store(each, value)
        elif isinstance(node.value, ast.Tuple):
            self._assign_each(target.elts, node.value.elts)
        else:
            value = self._text(node.value)
            value = value if value.text.isidentifier() else self._hold(value)
            for place, (each, kind) in enumerate(zip(target.elts, value.type, strict=True)):
                self._store(each, Text(f'{value.text}.v{place}', kind))

    def _assign_each(self, targets: Sequence[Any], values: Sequence[Any]) -> None:
        """Assign several values, all of them known before the first target changes."""
        read = {each.id for value in values for each in ast.walk(value) if isinstance(each, ast.Name)}
        simple = all(isinstance(each, ast.Name) and each.id not in read for each in targets)
        held = []
        for target, value in zip(targets, values, strict=True):
            constant = self._constant(value)
            if isinstance(constant, tuple):
                self._constants[target.id] = constant
            else:
                text = self._text(value)
                held.append((target, text if simple or constant is not None else self._hold(text)))
        for target, text in held:
            self._store(target, text)

    def _store(self, target: Any, value: Text) -> None:
        if isinstance(target, ast.Name):
            if target.id != '_':
                kind = self._common(target, self._types.get(target.id, value.type), value.type)
                self._types[target.id] = kind
                self._write(f'{_c_name(target.id)} = {_bare(self._as(target, value, kind))};')
        elif isinstance(target, ast.Attribute):
            place = self._text(target)
            self._writes = True
            self._write(f'{place.text} = {_bare(self._as(target, value, place.type))};')
        elif not isinstance(target.slice, ast.Slice):
            self._set(target, self._text(target.value), self._text(target.slice).text, value)
        elif target.slice.lower or target.slice.upper:
            self._refuse(target)
        else:
            self._store_all(target, self._text(target.value), value)

    def _store_all(self, target: Any, array: Text, value: Text) -> None:
        """Write a number, or the numbers of an array, into each place of an array."""
        self._held += 1
        place = f'value_{self._held}'
        self._loop(place, 'INT64_C(0)', self._length(target, array), ())
        self._depth += 1
        closing = self._lines.pop()
        number = self._item(target, value, place) if isinstance(value.type, Array) else value
        self._set(target, array, place, number)
        self._depth -= 1
        self._lines.append(closing)

    def _set(self, node: Any, array: Text, place: str, value: Text) -> None:
        self._writes = True
        if isinstance(array.type, Pointer):
            self._write(f'{self._item(node, array, place).text} = {self._as(node, value, array.type.seen)};')
        else:
            self._write(f'engine_mount_array_set({array.text}, {_bare(place)}, {_bare(value.text)});')

    # Expressions.

    def _constant(self, node: Any) -> Any:
        """Return the value of numbers and names of the module alone, or a tuple of such, else None."""
        plain = {'int': int, 'float': float, 'len': len}
        calls = [ast.unparse(each.func) for each in ast.walk(node) if isinstance(each, ast.Call)]
        names = {each.id for each in ast.walk(node) if isinstance(each, ast.Name)}
        if isinstance(node, ast.Tuple) or {*calls} - {*plain} or names & (self._own - {*self._constants}):
            return None
        known = {**self._function.__globals__, **self._constants, **plain}
        try:
            value = eval(compile(ast.Expression(node), '', 'eval'), known)
        except (NameError, AttributeError, TypeError, ValueError):
            return None
        return value if isinstance(value, bool | int | float | np.number | tuple) else None

    def _value(self, node: Any) -> Any:
        """Return what a name of the module means: a function, a type."""
        known = {**self._function.__globals__, **dict.fromkeys(self._own)}
        return eval(compile(ast.Expression(node), '', 'eval'), known)

    def _text(self, node: Any) -> Text:
        constant = self._constant(node)
        if constant is not None and not isinstance(constant, tuple):
            return literal(constant)
        return getattr(self, f'_text_{type(node).__name__.lower()}', self._refuse)(node)

    def _truth(self, node: Any) -> str:
        value = self._text(node)
        return value.text if value.type == TRUTH else self._refuse(node, 'no truth value')

    def _common(self, node: Any, one: Type, other: Type) -> Type:
        if one != other and {one, other} != {FLOAT, WHOLE}:
            if type(one) is type(other) is tuple and len(one) == len(other):
                return tuple(self._common(node, a, b) for a, b in zip(one, other, strict=True))
            name = self._unit.declarations.name
            self._refuse(node, f'{name(other)} where there was {name(one)}')
        return one if one == other else FLOAT

    def _as(self, node: Any, value: Text, kind: Type) -> str:
        """Return a value as one of another type, which must be able to hold it."""
        if (value.type, kind) == (WHOLE, FLOAT):
            return f'(double){value.text}'
        self._common(node, kind, value.type)
        return value.text if value.type == kind else self._refuse(node, f'{kind} is needed')

    def _text_name(self, node: Any) -> Text:
        return Text(_c_name(node.id), self._types.get(node.id) or self._refuse(node, 'it has no value here'))

    def _text_attribute(self, node: Any) -> Text:
        value = self._text(node.value)
        if isinstance(value.type, Tables):
            return Text(f'{value.text}.{node.attr}', getattr(value.type, node.attr))
        if node.attr == 'size':
            return self._length(node, value)
        kind, inner = value.type.field(node.attr), value.text.startswith('&')
        access = f'{value.text[1:]}.{node.attr}' if inner else f'{value.text}->{node.attr}'
        return Text(f'&{access}' if isinstance(kind, Pointer) else access, kind)

    def _text_subscript(self, node: Any) -> Text:
        value, part = self._text(node.value), node.slice
        if isinstance(part, ast.Slice):
            begin = self._text(part.lower).text if part.lower else 'INT64_C(0)'
            end = self._text(part.upper) if part.upper else self._length(node, value)
            return Text(f'engine_mount_{value.type.kind}_part({value.text}, {begin}, {end.text})', value.type)
        if type(value.type) is tuple:
            return Text(f'{value.text}.v{part.value}', value.type[part.value])
        return self._item(node, value, self._text(part).text)

    def _length(self, node: Any, value: Text) -> Text:
        if isinstance(value.type, Pointer):
            return literal(value.type.length)
        return Text(f'{value.text}.size', WHOLE) if isinstance(value.type, Array) else self._refuse(node)

    def _item(self, node: Any, value: Text, place: str) -> Text:
        if isinstance(value.type, Array):
            return Text(f'engine_mount_{value.type.kind}_item({value.text}, {_bare(place)})', FLOAT)
        if value.type.seen == RECORD:  # `memory.view(TYPE)[0]`
            return value
        return Text(f'{value.text}->{_ROWS[value.type.seen]}[{_bare(place)}]', value.type.seen)

    def _text_tuple(self, node: Any) -> Text:
        values = [self._text(each) for each in node.elts]
        kinds = tuple(each.type for each in values)
        if type(self._result) is tuple and node is self._root:
            kinds = self._common(node, self._result, kinds)
        texts = [_bare(self._as(node, value, kind)) for value, kind in zip(values, kinds, strict=True)]
        return Text(f'({self._unit.declarations.name(kinds)}){{ {", ".join(texts)} }}', kinds)

    def _text_unaryop(self, node: Any) -> Text:
        if isinstance(node.op, ast.Not):
            return Text(f'(!{self._truth(node.operand)})', TRUTH)
        value = self._text(node.operand)
        return Text(f'(-{value.text})', value.type) if isinstance(node.op, ast.USub) else self._refuse(node)

    def _text_binop(self, node: Any) -> Text:
        return self._arithmetic(node, node.op, self._text(node.left), self._text(node.right))

    def _arithmetic(self, node: Any, operator: ast.operator, left: Text, right: Text) -> Text:
        sign, kind = _SIGNS.get(type(operator)), self._common(node, left.type, right.type)
        if isinstance(operator, ast.Pow) and right.text == 'INT64_C(2)':
            return Text(f'engine_mount_square({_bare(left.text)})', FLOAT)
        if helper := _OF_WHOLE.get(type(operator)):
            return self._helper(node, helper, WHOLE, [left, right], WHOLE)
        kind = FLOAT if sign == '/' else kind
        if sign is None or kind not in (FLOAT, WHOLE):
            self._refuse(node)
        return Text(f'({self._as(node, left, kind)} {sign} {self._as(node, right, kind)})', kind)

    def _helper(self, node: Any, name: str, kind: Type, values: Sequence[Text], result: Type) -> Text:
        texts = ', '.join(_bare(self._as(node, each, kind)) for each in values)
        return Text(f'engine_mount_{name}({texts})', result)

    def _text_boolop(self, node: Any) -> Text:
        return Text(f'({f" {_SIGNS[type(node.op)]} ".join(map(self._truth, node.values))})', TRUTH)

    def _text_compare(self, node: Any) -> Text:
        values, parts = [self._text(each) for each in (node.left, *node.comparators)], []
        for operator, left, right in zip(node.ops, values, values[1:], strict=False):
            sign, kind = _SIGNS.get(type(operator)), self._common(node, left.type, right.type)
            parts.append(
                f'({self._as(node, left, kind)} {sign or self._refuse(node)} {self._as(node, right, kind)})'
            )
        return Text(parts[0] if len(parts) == 1 else f'({" && ".join(parts)})', TRUTH)

    def _text_ifexp(self, node: Any) -> Text:
        yes, no = self._text(node.body), self._text(node.orelse)
        kind = self._common(node, yes.type, no.type)
        return Text(
            f'({self._truth(node.test)} ? {self._as(node, yes, kind)} : {self._as(node, no, kind)})', kind
        )

    def _text_call(self, node: Any) -> Text:
        if isinstance(node.func, ast.Attribute) and node.func.attr == 'view':
            return self._view(node)
        if isinstance(node.func, ast.Attribute) and node.func.attr == 'max':
            return Text(f'engine_mount_array_max({self._text(node.func.value).text})', FLOAT)
        function, values = self._value(node.func), [self._text(each) for each in node.args]
        kind = values[0].type
        if function in (min, max, abs):
            kind = self._common(node, kind, values[-1].type)
            return self._helper(node, function.__name__ + '_whole' * (kind == WHOLE), kind, values, kind)
        if function is int and kind == FLOAT:
            return self._helper(node, 'cut', FLOAT, values, WHOLE)
        if function in (int, float):
            kind = WHOLE if function is int else FLOAT
            return Text(self._as(node, values[0], kind), kind)
        if function is len:
            return self._length(node, values[0])
        if function in _OF_FLOAT:
            return self._helper(node, _OF_FLOAT[function][0], FLOAT, values, _OF_FLOAT[function][1])
        if not hasattr(getattr(function, 'py_func', function), '__code__') or node.keywords:
            self._refuse(node)
        known = self._unit.translated(function, [each.type for each in values])
        self._writes = self._writes or known.writes
        text = Text(f'{known.name}({", ".join(_bare(each.text) for each in values)})', known.result)
        if not known.writes or node is self._root:
            return text
        return self._hold(text) if node is self._first else self._refuse(node, 'it writes amid other parts')

    def _view(self, node: Any) -> Text:
        """Return what is at a `Pointer` seen otherwise, or the bits of a number as one of the other kind."""
        wanted = self._value(node.args[0])
        kind = {np.float64: FLOAT, np.int64: WHOLE}.get(wanted, RECORD)
        if isinstance(node.func.value, ast.Call):  # np.float64(x), np.int64(x)
            value = self._text(node.func.value.args[0])
            return Text(f'engine_mount_{"number" if kind == FLOAT else "bits"}_of({_bare(value.text)})', kind)
        value = self._text(node.func.value)
        if not isinstance(value.type, Pointer) or value.type.seen != MEMORY:
            self._refuse(node)
        inner = kind == RECORD and not value.type.constant
        return Text(f'&{value.text}->record' if inner else value.text, value.type._replace(seen=kind))


def _first(node: Any) -> Any:
    """Return the part of an expression that is evaluated before all others, as far as operators go."""
    while inner := next((v for n in ('left', 'operand', 'values') if (v := getattr(node, n, None))), None):
        node = inner[0] if isinstance(inner, list) else inner
    return node


def literal(value: Any) -> Text:
    """Return a number as a C constant of the same bits."""
    if isinstance(value, bool | np.bool_):
        return Text(str(value).lower(), TRUTH)
    if isinstance(value, int | np.integer):
        return Text(f'INT64_C({value})' if value >= 0 else f'(-INT64_C({-value}))', WHOLE)
    if not math.isfinite(value):
        return Text(f'engine_mount_number_of({literal(np.float64(value).view(np.int64)).text})', FLOAT)
    return Text(f'{float(value)!r}' if math.copysign(1.0, value) > 0.0 else f'({float(value)!r})', FLOAT)


def _bare(text: str) -> str:
    """Return an expression without parentheses around all of it."""
    depth, whole = 0, text.startswith('(') and text.endswith(')')
    for sign in text[:-1] if whole else '':
        depth += (sign == '(') - (sign == ')')
        whole = whole and depth > 0
    return text[1:-1] if whole else text


def _wrapped(text: str, indent: str) -> str:
    further = indent + '        '
    return textwrap.fill(text, 110, initial_indent=indent, subsequent_indent=further, break_on_hyphens=False)


def _c_name(name: str) -> str:
    return 'unused' if name == '_' else name + '_' * (name in _KEYWORDS.split())
