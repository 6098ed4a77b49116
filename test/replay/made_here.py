"""Run as a process of its own: makes with this processor what must be the same bytes on every other.

Arguments: a new folder, the references, recordings to replay. Prints as JSON what the libraries take the
processor for, versions, hashes of the laws, and whether the recorded answers were met.
"""

import hashlib
import json
import math
import platform
import sys
from pathlib import Path

import numba
import numpy as np
from numba.core.registry import cpu_target
from numpy._core._multiarray_umath import __cpu_dispatch__, __cpu_features__
from threadpoolctl import threadpool_info

import engine_mount
from engine_mount.drives.loop.recording import record_core
from engine_mount.export.controller_in_c import built_in_sample, sequence_hash
from engine_mount.recordings.compare import compare
from engine_mount.settings.chosen import chosen_control
from engine_mount.signals.excitation import build_excitation
from mount_control.controller import ControlLaw, Controller
from mount_control.policy.registry import POLICIES
from mount_control.settings import ControlSettings
from mount_models.arithmetic import elementary
from mount_models.arithmetic.compiled import compiled
from mount_models.damper import DAMPERS, damper_curve
from mount_models.quantity import with_flattened
from mount_recorder.session import session_text
from mount_recorder.versions import versions
from mount_ros.topics import EVENT, SESSION, TOPICS
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
LAW_SAMPLES = 20_000
DATA = [topic for topic in TOPICS if topic not in (SESSION, EVENT) and not topic.name.startswith('/')]


def make(folder: Path, references: Path, recordings: list[Path]) -> dict[str, bool]:
    """Return which recorded answers were met."""
    folder.mkdir()
    for name, control in CONTROLS.items():
        parameters = {**DRIVE, 'mount_control': control}
        record_core(folder / name, parameters, session_text({'parameters': parameters}))
    np.savez(folder / 'numbers.npz', **numbers(folder))
    met = {}
    for each in [*sorted(path for path in references.iterdir() if path.is_dir()), *recordings]:
        outcome = engine_mount.replay(each, out=folder / 'replays' / each.name)
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
    curves = {name: damper_curve(name).table for name in DAMPERS}
    return {**shaken, **curves, **{policy: traces_of(policy) for policy in POLICIES}, **elementary_values()}


def traces_of(policy: str) -> np.ndarray:
    """Return all that a policy traces of the sequence that the law in C has built in."""
    settings = settings_of(policy)
    table = settings.table([0.5, 1.5, 3.0], [0.0, 100.0, 250.0], 0.5)
    samples, frequencies, random = np.empty(LAW_SAMPLES), np.empty(LAW_SAMPLES), 1
    for n in range(LAW_SAMPLES):
        random, _, samples[n], frequencies[n], _ = built_in_sample(n, random)
    return Controller(ControlLaw(settings, table)).run(samples, crank_frequency=frequencies)


def settings_of(policy: str) -> ControlSettings:
    return chosen_control({'mount_control': {'policy': policy}})


def elementary_values() -> dict[str, np.ndarray]:
    """Return the elementary functions of as many arguments."""
    arguments = (np.arange(LAW_SAMPLES) - 0.5 * LAW_SAMPLES) * 3.7e-3
    functions = {
        'exp': elementary.exp, 'expm1': elementary.expm1, 'atan': elementary.atan, 'log': elementary.log
    }  # fmt: skip
    found = {
        name: np.array([function(abs(x) if name == 'log' else x) for x in arguments])
        for name, function in functions.items()
    }
    return {**found, 'sine': elementary.sines(arguments), 'cosine': elementary.cosines(arguments)}


def sums_of_products(a, b, c):
    """Return `a * b + c`, which a fused instruction would round once only."""
    result = np.empty(a.size)
    for k in range(a.size):
        result[k] = a[k] * b[k] + c[k]
    return result


def fused(**permission: bool) -> int:
    """Return how many products are not rounded before a sum as the project compiles, and with a permission.

    They are compiled in memory: from disk numba takes no function of a script that was a module before.
    """
    function = numba.jit(**compiled(sums_of_products).targetoptions, **permission)(sums_of_products)
    a = 1.0 + np.arange(LAW_SAMPLES) / 7.0
    return int(np.count_nonzero(function(a, a, -(a * a))))


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


def differences_of(here: Path, there: Path, paths: list[str]) -> list[str]:
    """Return which topics of recordings and which numbers are other bytes in the second folder, and where."""
    told = []
    for path in paths:
        a, b = engine_mount.open(here / path), engine_mount.open(there / path)
        names = [topic for topic in DATA if topic.name in a]
        changed = [topic for topic in names if payloads(a, topic) != payloads(b, topic)]
        if changed:
            words = compare(a, b, topics=changed).difference_sentences()
            told.append(f'{path}, {", ".join(topic.name for topic in changed)}: {"; ".join(words)}')
    for file in sorted(here.rglob('numbers.npz')):
        a, b = np.load(file), np.load(there / file.relative_to(here))
        told += [text for name in a for text in differing_numbers(name, a[name], b[name])]
    return told


def payloads(recording, topic) -> list[bytes]:
    return [bytes(payload) for payload in recording[topic.name].payloads]


def differing_numbers(name: str, a: np.ndarray, b: np.ndarray) -> list[str]:
    """Return the first difference of two arrays, or of each of their fields, in words."""
    if a.dtype.names:
        return [
            text for each in a.dtype.names for text in differing_numbers(f'{name}.{each}', a[each], b[each])
        ]
    a, b = np.ascontiguousarray(a).ravel(), np.ascontiguousarray(b).ravel()
    places = np.flatnonzero(a.view(np.uint64) != b.view(np.uint64))
    if not places.size:
        return []
    values = ', '.join(repr(each[places[0]].item()) for each in (a, b))
    return [f'{name}: {places.size} of {a.size} numbers differ, first number {places[0]}: {values}']


if __name__ == '__main__':
    target, reference_folder, *replayed = map(Path, sys.argv[1:])
    result = make(target, reference_folder, replayed)
    said = {
        'met': result,
        'seen': seen_by_libraries(),
        'versions': versions(),
        'laws': {policy: f'{sequence_hash(settings_of(policy), LAW_SAMPLES):016x}' for policy in POLICIES},
        'fused': fused(),
        'fused_if_permitted': fused(fastmath=True),
    }
    print(json.dumps(said))
