"""The exported controller in C: built by a compiler, loaded, and called as a Python object."""

import ctypes
import os
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from engine_mount.export.controller_in_c import NAME, law_numbers, write_controller
from engine_mount.settings.chosen import chosen_control
from mount_control.controller import compiled_with
from mount_models.arithmetic.record import record_dtype

FLAGS = ('-std=c11', '-ffp-contract=off', '-fno-math-errno')
WARNINGS = ('-Wall', '-Wextra', '-Wconversion', '-Wshadow', '-pedantic', '-Werror')
_BESIDE = Path(__file__).with_suffix('.c')


def compiler(name: str) -> str:
    """Return the path of a compiler; without it the test is skipped, which continuous integration refuses."""
    if (path := shutil.which(name)) is None:
        pytest.skip(f'{name} is not installed')
    return path


def built(folder: Path, name: str, *options: str) -> Path:
    """Return the shared library that a compiler makes of the controller in `folder`."""
    library = folder / f'{name}{"".join(options)}.so'
    subprocess.run(
        [compiler(name), *FLAGS, *options, '-shared', '-fPIC', '-I', folder, '-o', library,
         folder / f'{NAME}.c', _BESIDE],
        check=True,
    )  # fmt: skip
    return library


class CController:
    """One controller in C; laws are given as {parameter: value} of mount_control."""

    def __init__(self, library: Path, values: dict):
        settings = chosen_control({'mount_control': values})
        self._compiled = compiled_with(settings.policy)
        self._c = ctypes.CDLL(os.fspath(library))
        self._c.engine_mount_controller_step.restype = ctypes.c_double
        self._c.engine_mount_controller_sequence_hash.restype = ctypes.c_uint64
        self._c.engine_mount_controller_self_test.restype = ctypes.c_bool
        self._c.state_of.restype = ctypes.c_void_p
        size = ctypes.c_int64.in_dll(self._c, 'engine_mount_controller_size').value
        self._memory = np.zeros(size // 8, np.int64)
        self._laws: list = []  # C keeps only where they are
        self._c.engine_mount_controller_start(self._at, self._law(values))

    @property
    def _at(self) -> ctypes.c_void_p:
        return ctypes.c_void_p(self._memory.ctypes.data)

    @property
    def state(self) -> np.ndarray:
        """The memory of policy and force maker, as integers."""
        count = self._compiled.state.itemsize // 8
        address = self._c.state_of(self._at)
        return np.frombuffer((ctypes.c_int64 * count).from_address(address), np.int64)

    def _law(self, values: dict) -> ctypes.c_void_p:
        law = law_numbers(chosen_control({'mount_control': values}))
        table = np.array([*law.table, 0.0])
        numbers = np.frombuffer(law.numbers.tobytes(), np.int64)
        assert numbers.size * 8 == record_dtype(self._compiled.law).itemsize
        limits = np.array([law.displacement_range]).view(np.int64)
        whole = [table.ctypes.data, law.table.size, law.window, law.period, law.longest_bridge]
        self._laws.append((np.concatenate([numbers, whole, limits]), table))
        return ctypes.c_void_p(self._laws[-1][0].ctypes.data)

    def set_table(self, current, normal_force, offset_current: float) -> int:
        columns = [np.array(each, float) for each in (current, normal_force)]
        pointers = [ctypes.c_void_p(each.ctypes.data) for each in columns]
        return self._c.engine_mount_controller_set_table(
            self._at, *pointers, ctypes.c_int64(len(columns[0])), ctypes.c_double(offset_current)
        )

    def transfer(self, values: dict) -> int:
        return self._c.engine_mount_controller_transfer(self._at, self._law(values))

    def step(self, stamp: int, displacement: float, crank_frequency: float = 0.0) -> float:
        numbers = map(ctypes.c_double, (displacement, crank_frequency))
        return self._c.engine_mount_controller_step(self._at, ctypes.c_int64(stamp), *numbers)

    def run(self, stamps: np.ndarray, *columns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return currents (A) and traces of n samples; columns: displacements (m) and, perhaps, Hz."""
        stamps = np.ascontiguousarray(stamps)
        given = np.array([*columns, np.zeros(len(stamps))][:2])
        currents = np.zeros(len(stamps))
        traces = np.zeros(len(stamps), self._compiled.trace)
        pointers = [ctypes.c_void_p(each.ctypes.data) for each in (stamps, *given, currents, traces)]
        self._c.run(self._at, *pointers[:3], ctypes.c_int64(len(stamps)), *pointers[3:])
        return currents, traces

    def sequence_hash(self, samples: int) -> int:
        return self._c.engine_mount_controller_sequence_hash(self._at, ctypes.c_int64(samples))

    def self_test(self) -> bool:
        return self._c.engine_mount_controller_self_test(self._at)


def exported(folder: Path, values: dict) -> Path:
    """Return the folder with the controller of {parameter: value} of mount_control in C."""
    write_controller({'mount_control': values}, folder)
    return folder
