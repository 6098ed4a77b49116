"""No number of a node, a core run or a replay passes a function that differs from processor to processor.

`docs/explanation/same_bytes.md` says why; `test/replay/test_same_bytes.py` shows it
for what it runs. This test also sees what that one does not run.
"""

import ast
import importlib.util
from collections.abc import Iterator
from functools import cache
from pathlib import Path

ROOTS = (
    'mount_driver.node', 'mount_init.node', 'mount_control.node', 'mount_sim.node',
    'engine_mount.drives.loop.recording', 'engine_mount.drives.replay',
)  # fmt: skip
JUDGES = {'engine_mount.drives.agreement'}
"""Modules that judge answers when they are there; what they alone need makes no number of a run."""
OF_LIBRARIES = {
    *('exp', 'exp2', 'expm1', 'log', 'log1p', 'log2', 'log10', 'sin', 'cos', 'tan', 'asin', 'acos', 'atan'),
    *(
        'arcsin',
        'arccos',
        'arctan',
        'arctan2',
        'atan2',
        'sinh',
        'cosh',
        'tanh',
        'hypot',
        'pow',
        'power',
        'sinc',
    ),
    *('dot', 'vdot', 'inner', 'matmul', 'tensordot', 'einsum', 'convolve', 'correlate', 'linalg', 'fft'),
    *('interp', 'polyfit', 'mean', 'average', 'std', 'var', 'sum', 'cumsum', 'prod', 'trapezoid', 'random'),
}
"""Functions of `math` and numpy that choose instructions by the processor, contract, or sum in any order."""
METHODS = {'mean', 'std', 'var', 'dot'}
ALLOWED = {
    ('mount_sim.random_numbers', 'np.random'): 'whole numbers of PCG64',
    ('mount_models.arithmetic.elementary', '**'): 'powers of whole numbers and fractions',
    ('mount_sim.plant.car', 'np.linalg'): 'whether parameters are refused, no number of a run',
    ('mount_sim.plant.engine_body', 'np.linalg'): 'natural frequencies, by which parameters are refused',
    ('mount_models.coil.crossing', 'np.cumsum'): 'whole numbers',
    ('mount_init.ramp', 'np.cumsum'): 'whole numbers',
    ('engine_mount.recordings.times', 'np.cumsum'): 'whole numbers',
    ('engine_mount.recordings.times', 'np.interp'): 'times told to people',
    ('engine_mount.signals.selection', 'np.interp'): 'rows of racks and rigs, no number of a run',
    ('engine_mount.recordings.times', 'np.mean'): 'rates of topics, for the eye',
    ('mount_driver.watches.ripple_sweep', 'np.interp'): 'limits of a watch, no number of a sound run',
    ('mount_ros.timing', 'np.cumsum'): 'whole numbers',
    ('mount_ros.timing', 'math.log10'): 'bins of latency, for the eye',
    ('mount_ros.timing', '**'): 'bins of latency, for the eye',
}


def test_no_number_passes_what_depends_on_the_processor():
    found = {(module, what) for module in modules() for what in suspicious(source_of(module))}
    assert found - set(ALLOWED) == set()
    assert set(ALLOWED) <= found


def suspicious(source: str) -> Iterator[str]:
    """Give what in a source depends on the processor."""
    tree = ast.parse(source)
    in_compiled = {id(node) for function in _compiled_functions(tree) for node in ast.walk(function)}
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom | ast.Import):
            yield from _imported(node)
        elif isinstance(node, ast.BinOp) and isinstance(node.op, ast.MatMult):
            yield '@'
        elif isinstance(node, ast.BinOp) and isinstance(node.op, ast.Pow):
            if not _is_exact(node, id(node) in in_compiled):
                yield '**'
        elif isinstance(node, ast.Attribute) and _library(node):
            if node.attr in OF_LIBRARIES:
                yield f'{_library(node)}.{node.attr}'
        elif isinstance(node, ast.Call) and _method(node.func) in METHODS:
            yield f'.{_method(node.func)}'


def _compiled_functions(tree: ast.AST) -> Iterator[ast.FunctionDef]:
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef) and 'compiled' in map(ast.unparse, node.decorator_list):
            yield node


def _is_exact(power: ast.BinOp, compiled: bool) -> bool:
    """Whether a power is a compiled square, one of whole numbers, or one of two; else it passes `pow`."""
    base, exponent = ast.unparse(power.left), ast.unparse(power.right)
    if not exponent.lstrip('-').isdigit():
        return False
    return (compiled and exponent == '2') or base.isdigit() or base == '2.0'


def _library(node: ast.Attribute) -> str:
    name = node.value.id if isinstance(node.value, ast.Name) else ''
    return name if name in ('math', 'np') else ''


def _method(called: ast.expr) -> str:
    return called.attr if isinstance(called, ast.Attribute) and not _library(called) else ''


def _imported(node: ast.ImportFrom | ast.Import) -> Iterator[str]:
    if isinstance(node, ast.ImportFrom) and node.module in ('math', 'numpy'):
        yield from (f'{node.module}.{each.name}' for each in node.names if each.name in OF_LIBRARIES)
    names = [node.module or ''] if isinstance(node, ast.ImportFrom) else [each.name for each in node.names]
    yield from ('scipy' for name in names if name.split('.')[0] == 'scipy')


def modules() -> set[str]:
    """Return all modules of this project that one of the `ROOTS` needs, however far down."""
    known, waiting = set(), list(ROOTS)
    while waiting:
        module = waiting.pop()
        if module not in known | JUDGES:
            known.add(module)
            waiting += [each for each in _needs(source_of(module)) if each not in known]
    return known


def _needs(source: str) -> Iterator[str]:
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.ImportFrom) and (node.module or '').startswith(('mount_', 'engine_mount')):
            for name in (node.module, *(f'{node.module}.{each.name}' for each in node.names)):
                if name is not None and _file(name) is not None:
                    yield name


@cache
def _file(module: str) -> Path | None:
    try:
        spec = importlib.util.find_spec(module)
    except ModuleNotFoundError:
        return None
    return Path(spec.origin) if spec is not None and spec.origin is not None else None


def source_of(module: str) -> str:
    file = _file(module)
    assert file is not None, module
    return file.read_text(encoding='utf-8')
