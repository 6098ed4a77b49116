"""Run as a process of its own: makes with this processor what must be the same bytes on every other.

Arguments: a new folder, the references, recordings to replay. Prints how the libraries see the
processor, and whether the recorded answers were met, as JSON.
"""

import hashlib
import json
import math
import platform
import sys
from pathlib import Path

import numpy as np
from numba.core.registry import cpu_target
from numpy._core._multiarray_umath import __cpu_dispatch__, __cpu_features__
from threadpoolctl import threadpool_info

from engine_mount.drives.loop.recording import record_core
from engine_mount.drives.replay import replay
from engine_mount.signals.excitation import build_excitation
from mount_models.damper import DAMPERS, damper_curve
from mount_models.quantity import with_flattened
from mount_recorder.session import session_text
from mount_sim.parameters import SimParameters

DRIVE = {
    'mount_sim': {
        'scenario': 'motorway',
        'seed': 3,
        'timeline.start': 2.8,
        'timeline.duration': 0.7,
        'motorway.gap_time': 0.1,
        'motorway.gap_depth': 0.03,
        'idle.amplitude': 80.0,
        'electronics.coil_temperature': 55.0,
    },
}
"""A warm initialisation, then a gap in a random road under an idling engine."""
CONTROLS = {
    'switched_viscous': {'policy': 'switched_viscous', 'damper': 'degressive'},
    'continuous_viscous': {'policy': 'continuous_viscous'},
}
"""What drives it, by the name of the recording."""


def make(folder: Path, references: Path, recordings: list[Path]) -> dict[str, bool]:
    """Return which recorded answers were met."""
    folder.mkdir()
    for name, control in CONTROLS.items():
        parameters = {**DRIVE, 'mount_control': control}
        record_core(folder / name, parameters, session_text({'parameters': parameters}))
    np.savez(folder / 'numbers.npz', **numbers(folder))
    met = {}
    for each in [*sorted(path for path in references.iterdir() if path.is_dir()), *recordings]:
        outcome = replay(each, out=folder / 'replays' / each.name)
        met[each.name] = outcome.held
    return met


def numbers(folder: Path) -> dict[str, np.ndarray]:
    """Return what else becomes bytes of a drive: the excitations of all scenarios, the damper curves."""
    times = np.arange(300) / 150.0 + 1e-4 * np.cos(np.arange(300))
    table = np.stack([times - times[0], np.sin(9.0 * times)], axis=1)
    np.savetxt(folder / 'shaken.csv', table, '%.6f', ',', header='t,az', comments='')
    chosen = {
        'bench': {'timeline.duration': 1.0},
        'sweep': {'timeline.duration': 5.0},
        'recorded': {'recorded.file': str(folder / 'shaken.csv'), 'recorded.column': 'az'},
    }
    shaken = {
        name: build_excitation(with_flattened(SimParameters(), {'scenario': name, **values})).values[:]
        for name, values in chosen.items()
    }
    return {**shaken, **{name: damper_curve(name).table for name in DAMPERS}}


def seen_by_libraries() -> dict[str, object]:
    """Return what BLAS, numpy, numba and the C library take the processor for."""
    values = [function(-3e-3 * k) for k in range(20_000) for function in (math.sin, math.exp)]
    _, name, features = cpu_target.target_context.codegen().magic_tuple()
    return {
        'blas': sorted({f'{each["internal_api"]} {each.get("architecture")}' for each in threadpool_info()}),
        'numpy': [feature for feature in __cpu_dispatch__ if __cpu_features__[feature]],
        'numba': f'{name} {"fma" if "+fma" in features.split(",") else "no fma"}',
        'c_library': hashlib.sha256(np.array(values)).hexdigest()[:12],
        'machine': platform.machine(),
    }


if __name__ == '__main__':
    target, reference_folder, *replayed = map(Path, sys.argv[1:])
    result = make(target, reference_folder, replayed)
    print(json.dumps({'met': result, 'seen': seen_by_libraries()}))
