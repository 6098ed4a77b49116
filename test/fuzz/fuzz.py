"""Passes very many mutated inputs through the properties of the tests of foreign bytes; run by hand.

    .venv/bin/python test/fuzz/fuzz.py --inputs 1000000 [--only frames] [--first 0]
    .venv/bin/python test/fuzz/fuzz.py --guided 600 --only frames

The inputs are numbered: a failure names the number, which as an `@example` of its test is a regression test.
One that computes for longer than 2 s, waits for longer than a minute, or makes numpy warn (of a number that
overflows) is a failure too. With `--guided` and the package `atheris` in the environment, code coverage
chooses the inputs for so many seconds.
"""

import argparse
import contextlib
import importlib
import signal
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path

ROOT = Path(__file__).parents[2]
LIMIT = 2.0  # s of the processor, chosen: an input that takes longer hangs
LONGEST_WAIT = 60.0  # s by the wall clock, chosen: a loaded machine takes that long for nothing
Check = Callable[[int], None]


class HangError(AssertionError):
    """An input computed for longer than `LIMIT` or waited for longer than `LONGEST_WAIT`."""


def property_of(package: str, module: str, name: str, room: str = ''):
    """Return the property `name` of a test module of `package`, as hypothesis wrapped it."""
    folder = str(ROOT / 'src' / package / 'test' / room)
    if folder not in sys.path:
        sys.path.insert(0, folder)
    found = importlib.import_module(module)
    assert Path(found.__file__ or '').parent == Path(folder), f'{module} was found elsewhere'
    return getattr(found, name)


@contextlib.contextmanager
def all_targets() -> Iterator[dict[str, list[Check]]]:
    """Give {kind of input: checks of one number}; files of the readers live in a folder that goes."""
    with tempfile.TemporaryDirectory() as folder:
        yield {**bytes_targets(), **text_targets(), **settings_targets(), **file_targets(Path(folder))}


def bytes_targets() -> dict[str, list[Check]]:
    """Return the checks of frames, datagrams and messages."""
    sys.modules.pop('test_foreign_bytes', None)
    frames = [
        plain(property_of('mount_driver', 'test_foreign_bytes', name))
        for name in (
            'test_a_mutated_frame_is_used_only_if_it_is_the_one_that_was_sent',
            'test_a_mutated_status_is_none_or_has_numbers_within_its_limits',
            'test_a_mutated_datagram_is_a_frame_of_bytes_or_refused',
        )
    ]
    sys.modules.pop('test_foreign_bytes')  # the other package's test has the same name
    message = plain(
        property_of('mount_ros', 'test_foreign_bytes', 'test_a_mutated_message_is_read_or_refused')
    )
    from mount_ros.topics import COIL_RIPPLE, DISPLACEMENT

    mark = plain(property_of('mount_ros', 'test_foreign_bytes', 'test_a_mutated_mark_keeps_its_words'))
    return {
        'frames': frames,
        'messages': [lambda seed: message(seed, (DISPLACEMENT, COIL_RIPPLE)[seed % 2]), mark],
    }


def text_targets() -> dict[str, list[Check]]:
    """Return the checks of YAML: specimens, dampers and the description of a recording."""
    names = (
        'test_a_changed_specimen_is_refused_or_all_of_its_numbers_are_finite',
        'test_a_changed_damper_is_refused_or_opposes_motion',
    )
    checks = [plain(property_of('mount_models', 'test_foreign_text', name)) for name in names]
    return {'specimen': checks[:1], 'damper': checks[1:]}


def settings_targets() -> dict[str, list[Check]]:
    """Return the checks of what a user sets: parameter files, options, sessions, changes at run time."""
    names = (
        'test_a_changed_parameter_file_is_refused_or_every_value_is_within_its_range',
        'test_a_changed_option_is_refused_or_within_its_range',
        'test_a_changed_session_is_refused_or_gives_a_sample_rate_within_its_range',
        'test_a_changed_value_at_run_time_is_refused_or_leaves_a_sound_controller',
    )
    return {
        'parameters': [plain(property_of('mount_bringup', 'test_foreign_settings', name)) for name in names]
    }


def file_targets(folder: Path) -> dict[str, list[Check]]:
    """Return the checks of recordings: MCAP by four writers and our own, sqlite3, `metadata.yaml`."""
    files = {
        name: property_of('engine_mount', 'test_foreign_files', name, 'recordings')
        for name in (
            'test_what_is_read_of_a_mutated_file_is_what_was_written_or_not_sound',
            'test_a_mutated_database_is_read_as_far_as_it_is_one',
            'test_a_mutated_description_is_understood_or_refused',
        )
    }
    mcap, sqlite, description = (plain(check) for check in files.values())
    module = sys.modules['test_foreign_files']
    intact = [small_drive(module, folder, name) for name in ('ours', *module.WRITERS)]
    database = module.written(folder / 'database', 5) / 'database.db3'
    stored = database, database.read_bytes()
    text = (intact[0][0].parent / 'metadata.yaml').read_bytes()
    return {
        'mcap': [lambda seed: mcap(intact[seed % len(intact)], seed, bool(seed // 8 % 2))],
        'sqlite': [lambda seed: sqlite(stored, seed, bool(seed % 2))],
        'metadata': [lambda seed: description(text, seed)],
    }


def small_drive(module, folder: Path, writer: str):
    """Return file, bytes and content of a recording of 3 samples as `writer` of the test makes it."""
    made = module.write_drive(folder / writer.replace(' ', '_'), 3, chunk_size=700)
    (file,) = made.glob('*.mcap')
    if writer != 'ours':
        module.rewritten(file, made / 'other.mcap', module.WRITERS[writer])
        (made / 'other.mcap').replace(file)
    return file, file.read_bytes(), module.contents(module.engine_mount.open(made))


def plain(test) -> Callable[..., None]:
    """Return the function that a property checks, to be called with inputs of one's own."""
    return test.hypothesis.inner_test


def count_through(checks: list[Check], first: int, inputs: int, name: str) -> list[int]:
    """Pass the inputs `first`, `first` + 1, ... through the checks in turn; return those that failed."""
    failed: list[int] = []
    begin = time.monotonic()
    for number in range(first, first + inputs):
        limit_time(LIMIT, LONGEST_WAIT)
        try:
            checks[number % len(checks)](number // len(checks))
        except Exception as error:
            failed.append(number)
            which = f'check {number % len(checks)}, number {number // len(checks)}'
            print(f'{name}: {which}: {type(error).__name__}: {error!s:.300}', flush=True)
    limit_time(0.0, 0.0)
    took = time.monotonic() - begin
    print(f'{name}: {inputs} inputs, {len(failed)} failed, {took:.0f} s', flush=True)
    return failed


def limit_time(computing: float, waiting: float) -> None:
    """Have a signal come after so many seconds of the processor or by the wall clock; 0: never."""
    signal.setitimer(signal.ITIMER_PROF, computing)
    signal.setitimer(signal.ITIMER_REAL, waiting)


def guide(check: Check, seconds: int) -> None:
    """Let coverage choose the inputs for `seconds`; ends the process as the fuzzer does."""
    import atheris

    atheris.instrument_all()

    def once(data: bytes) -> None:
        check(int.from_bytes(data[:8], 'little') >> 2)

    atheris.Setup([sys.argv[0], f'-max_total_time={seconds}', '-max_len=8', f'-timeout={LIMIT:.0f}'], once)
    atheris.Fuzz()


def main() -> int:
    """Run the chosen targets; 1 if an input failed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument('--inputs', type=int, default=10_000, help='of each kind')
    parser.add_argument('--first', type=int, default=0, help='number of the first input')
    parser.add_argument('--only', action='append', help='kind of input; may be repeated')
    parser.add_argument('--guided', type=int, metavar='SECONDS', help='let coverage choose')
    given = parser.parse_args()

    def hang(*_) -> None:
        raise HangError(f'computed for {LIMIT:g} s or waited for {LONGEST_WAIT:g} s')

    signal.signal(signal.SIGPROF, hang)
    signal.signal(signal.SIGALRM, hang)
    warnings.simplefilter('error', RuntimeWarning)
    failures = 0
    with all_targets() as targets:
        for name in given.only or targets:
            if given.guided:
                guide(targets[name][0], given.guided)
            failures += len(count_through(targets[name], given.first, given.inputs, name))
    return 1 if failures else 0


if __name__ == '__main__':
    sys.exit(main())
