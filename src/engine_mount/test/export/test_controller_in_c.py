"""The law in C answers to the bit as the one that mount_control runs, and 0 A to what it does not know."""

import subprocess
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from c_controller import FLAGS, WARNINGS, CController, built, compiler, exported
from typer.testing import CliRunner

from engine_mount.cli.command import app
from engine_mount.export.controller_in_c import NAME, sequence_hash
from engine_mount.settings.chosen import chosen_control
from mount_control.control_loop import ControlLoop
from mount_control.policy.registry import POLICIES

CURRENT, FORCE, OFFSET = (0.4, 0.9, 1.4, 2.2, 3.0), (0.0, 30.0, 80.0, 170.0, 280.0), 0.5
UNLIMITED = {'displacement_velocity': 100.0, 'displacement_noise': 0.1, 'displacement_stuck': 10.0}
CHANGES = {
    'switched_viscous': ({'eigenfrequency': 9.3, 'quality': 0.8}, {'switch_on_level': 0.0006},
                         {'eigenfrequency': 2.0}, {'damper': 'degressive'}, {'switching': 'always'}),
    'continuous_viscous': ({'eigenfrequency': 10.0, 'quality': 0.7}, {'damping_coefficient': 1500.0},
                           {'position_gain': 0.4}, {'eigenfrequency': 4.0}),
    'pad_probe': ({'friction_force': 90.0}, {'pulses': 30.0}, {'wait': 0.2}, {'largest_movement': 0.001}),
}  # fmt: skip
BASE = {'pad_probe': {'wait': 0.1, 'pulse_duration': 0.2, 'largest_movement': 0.005}}
SAMPLES = 1_000_000


def values_of(policy: str, changes: dict | None = None) -> dict:
    prefix = '' if policy == 'switched_viscous' else f'{policy}.'
    own = {f'{prefix}{name}': value for name, value in (BASE.get(policy, {}) | (changes or {})).items()}
    return {'policy': policy, **UNLIMITED, **own}


@pytest.fixture(scope='module', params=POLICIES)
def export(request, tmp_path_factory):
    """The files of a policy, and 10^6 samples with gaps, faults and changes that Python answered."""
    policy = request.param
    return SimpleNamespace(
        policy=policy,
        values=values_of(policy),
        folder=exported(tmp_path_factory.mktemp(policy), values_of(policy)),
        drive=drive_of(policy, SAMPLES),
    )


def drive_of(policy: str, count: int) -> SimpleNamespace:
    random = np.random.default_rng(7)
    steps = np.where(random.random(count) < 0.003, random.integers(2, 40, count), 1) * 1_000_000
    stamps = np.cumsum(steps) + random.choice([-100_000, 0, 0, 70_000], count)
    seconds = stamps * 1e-9
    sway = 1.2e-3 * np.sin(2 * np.pi * 8.0 * seconds) * (np.sin(2 * np.pi * 0.15 * seconds) > -0.3)
    idle = 4e-5 * np.sin(2 * np.pi * 27.3 * seconds) * (np.sin(2 * np.pi * 0.05 * seconds) > 0.0)
    displacements = sway + idle + random.normal(0.0, 3e-6, count)
    frequencies = np.repeat(random.uniform(-5.0, 50.0, count // 100), 100)
    frequencies[random.integers(0, count, count // 1000)] = np.nan
    for fault in (np.nan, np.inf, -0.021, 3.0):
        displacements[random.integers(0, count, count // 4000)] = fault
    places = np.sort(random.choice(count, count // 5000, replace=False)).tolist()
    laws = [values_of(policy, CHANGES[policy][k % len(CHANGES[policy])]) for k in range(len(places))]
    changes = dict(zip(places, laws, strict=True))
    loop = ControlLoop()
    settings = chosen_control({'mount_control': values_of(policy)})
    loop.measured_before = True
    loop.begin(settings, settings.table(CURRENT, FORCE, OFFSET), 0)
    of_law = {place: [chosen_control({'mount_control': law})] for place, law in changes.items()}
    answers = loop.step_many(stamps, displacements, of_law, frequencies)
    assert 0.0005 < np.mean(~answers.traced) < 0.01
    assert np.mean(answers.currents > OFFSET) > 0.05
    columns = stamps, displacements, frequencies
    return SimpleNamespace(columns=columns, changes=changes, answers=answers)


@pytest.mark.parametrize('level', ['-O0', '-O2', '-O3'])
@pytest.mark.parametrize('name', ['gcc', 'clang'])
def test_c_answers_to_the_bit_as_python(export, name, level):
    controller = CController(built(export.folder, name, level, *WARNINGS), export.values)
    assert controller.set_table(CURRENT, FORCE, OFFSET) == 0
    drive, begin, currents, traces = export.drive, 0, [], []
    for place in [*drive.changes, SAMPLES]:
        answers = controller.run(*(column[begin:place] for column in drive.columns))
        currents.append(answers[0])
        traces.append(answers[1])
        begin = place
        if place < SAMPLES:
            assert controller.transfer(drive.changes[place]) == 0
    taken = drive.answers.traced
    assert np.concatenate(currents).tobytes() == drive.answers.currents.tobytes()
    assert np.concatenate(traces)[taken].tobytes() == drive.answers.traces[taken].tobytes()


@pytest.fixture(scope='module')
def library(export):
    return built(export.folder, 'gcc', '-O2')


@pytest.fixture
def controller(export, library):
    made = CController(library, export.values)
    assert made.set_table(CURRENT, FORCE, OFFSET) == 0
    return made


def sway(controller, begin=0, count=1000):
    stamps = (begin + np.arange(count) + 1) * 1_000_000
    currents, _ = controller.run(stamps, 1.2e-3 * np.sin(2 * np.pi * 8e-9 * stamps))
    return currents


def test_the_self_test_knows_the_sequence(export, controller):
    settings = chosen_control({'mount_control': export.values})
    assert controller.self_test()
    assert controller.sequence_hash(5000) == sequence_hash(settings, 5000)


def test_a_spoiled_memory_is_answered_with_0_ampere_and_cleared(controller):
    sway(controller)
    for begin, place in enumerate(range(len(controller.state)), 1):
        sway(controller, 1000 * begin)
        faults = controller.state[-1]
        controller.state[place] = np.array([np.nan]).view(np.int64)[0]
        spoiled_count = place == len(controller.state) - 1
        assert controller.step(1_000_001_000 * (begin + 1), 1e-3) == 0.0
        assert spoiled_count or controller.state[-1] == faults + 1
        controller.state[-1] = faults
    assert sway(controller, 1000 * (begin + 2)).max() > OFFSET


@pytest.mark.parametrize('value', [2**40, -1, np.array([1e300]).view(np.int64)[0]])
def test_a_memory_that_points_anywhere_never_reaches_beyond_an_array(controller, value):
    for place in range(len(controller.state)):
        sway(controller)
        controller.state[place] = value
        currents = sway(controller, 1000)
        assert ((currents >= 0.0) & (currents <= 3.0)).all()
        controller.set_table(CURRENT, FORCE, OFFSET)


@pytest.mark.parametrize(
    ('current', 'force', 'offset', 'status'),
    [
        (CURRENT, (2.0, *FORCE[1:]), OFFSET, 1),
        (CURRENT, (0.0, 30.0, 30.0, 170.0, 280.0), OFFSET, 2),
        ((0.4, 0.9, np.nan, 2.2, 3.0), FORCE, OFFSET, 2),
        (CURRENT, FORCE, 3.0, 3),
        (CURRENT, FORCE, np.nan, 3),
        ((), (), OFFSET, 4),
        (CURRENT, (*FORCE[:4], 501.0), OFFSET, 4),
    ],
)
def test_without_a_valid_table_there_is_no_current(controller, current, force, offset, status):
    assert sway(controller).max() > OFFSET
    assert controller.set_table(current, force, offset) == status
    assert (sway(controller, 1000) == 0.0).all()
    assert controller.set_table(CURRENT, FORCE, OFFSET) == 0
    assert sway(controller, 2000).max() > OFFSET


def test_a_stamp_that_did_not_rise_is_answered_with_0_ampere(controller):
    assert sway(controller)[-1] >= OFFSET
    assert [controller.step(stamp, 1e-3) for stamp in (1_000_000_000, 5, -3)] == [0.0] * 3
    assert controller.step(1_001_000_000, 0.0) >= OFFSET


def test_a_law_of_another_rate_is_refused_and_the_old_one_goes_on(export, controller):
    sway(controller)
    assert controller.transfer({**export.values, 'sample_rate': 500.0}) == 5
    assert controller.transfer({**export.values, 'highest_current': 0.4}) == 5
    assert controller.step(1_001_000_000, 0.0) >= OFFSET


@pytest.mark.parametrize(
    'options',
    [('-std=gnu11',), (*FLAGS, '-ffp-contract=fast'), (*FLAGS, '-ffast-math'), (*FLAGS, '-fmath-errno')],
)
def test_a_build_that_would_compute_otherwise_is_refused(export, options):
    done = subprocess.run(
        [compiler('gcc'), *options, '-fsyntax-only', export.folder / f'{NAME}.c'], capture_output=True
    )
    assert b'#error' in done.stderr


def test_the_example_of_the_page_compiles(export, tmp_path):
    page = (Path(__file__).parents[4] / 'docs' / 'how-to' / 'law_in_the_electronics.md').read_text()
    example = tmp_path / 'example.c'
    example.write_text(page.split('```c\n')[1].split('```')[0])
    command = [compiler('gcc'), *FLAGS, '-Wall', '-Werror', '-fsyntax-only', '-I', export.folder, example]
    subprocess.run(command, check=True)


def test_the_command_writes_what_python_writes(export, tmp_path):
    changes = [f'--set={name}={value}' for name, value in export.values.items() if name != 'policy']
    written = invoked('--out', str(tmp_path), '--policy', export.policy, *changes)
    assert written.exit_code == 0
    for suffix in ('.h', '.c'):
        assert (tmp_path / f'{NAME}{suffix}').read_bytes() == (export.folder / f'{NAME}{suffix}').read_bytes()


@pytest.mark.parametrize(
    ('options', 'sentence'),
    [
        (['--set', 'mount_sim.seed=1'], 'mount_control'),
        (['--policy', 'switched_viscous', '--set', 'continuous_viscous.quality=1.0'], 'no effect'),
    ],
)
def test_the_command_refuses_what_has_no_effect(tmp_path, options, sentence):
    done = invoked('--out', str(tmp_path), *options)
    assert done.exit_code != 0
    assert sentence in f'{done.output} {done.exception}'


def invoked(*options: str):
    return CliRunner().invoke(app, ['export', 'c', *options])


@pytest.mark.skipif(
    ' fma ' not in Path('/proc/cpuinfo').read_text(), reason='the processor contracts nothing'
)
def test_contraction_that_no_header_sees_fails_the_self_test(export):
    library = built(export.folder, 'clang', '-O2', '-mfma', '-ffp-contract=fast')
    assert not CController(library, export.values).self_test()


@pytest.mark.parametrize('name', ['gcc', 'clang'])
def test_no_function_of_a_library_is_called(export, name, tmp_path):
    file = tmp_path / 'law.o'
    subprocess.run([compiler(name), *FLAGS, '-O2', '-c', export.folder / f'{NAME}.c', '-o', file], check=True)
    undefined = subprocess.run(['nm', '-u', file], capture_output=True, text=True, check=True).stdout.split()
    assert {*undefined} <= {'U', 'memset', 'memcpy'}  # which a compiler makes of loops and assignments
