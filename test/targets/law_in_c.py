"""The hash of 20 000 samples of the law in C on another processor, emulated, beside that of Python here.

`python test/targets/law_in_c.py arm64` or `cortex-m`: exit code 0 where all are equal, 1 where one is not, 2
where a package is missing.
"""

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

from engine_mount.export.controller_in_c import NAME, sequence_hash, write_controller
from engine_mount.settings.chosen import chosen_control
from mount_control.policy.registry import DAMPERS

SAMPLES = 20_000
HERE = Path(__file__).parent
FLAGS = ['-std=c11', '-O2', '-ffp-contract=off', '-fno-math-errno', f'-DSAMPLES={SAMPLES}']
CONTRACTED = ['-ffp-contract=fast', '-U__GCC_IEC_559', '-D__GCC_IEC_559=1']
"""A build that contracts products and sums, past the header that refuses it: its hash must differ."""


class Target(NamedTuple):
    """Compiler and emulator as commands, and the packages of Debian that have them."""

    compiler: list[str]
    emulator: list[str]
    packages: str


TARGETS = {
    'arm64': Target(
        ['aarch64-linux-gnu-gcc', '-static'],
        ['qemu-aarch64-static'],
        'gcc-aarch64-linux-gnu libc6-dev-arm64-cross qemu-user-static',
    ),
    'cortex-m': Target(
        [
            *('arm-none-eabi-gcc', '-mcpu=cortex-m7', '-mfpu=fpv5-d16', '-mfloat-abi=hard', '-mthumb'),
            *(
                '-ffreestanding',
                '-nostdlib',
                '-T',
                str(HERE / 'mps2_an500.ld'),
                str(HERE / 'bare_cortex_m.c'),
            ),
        ],
        [
            *(
                'qemu-system-arm',
                '-machine',
                'mps2-an500',
                '-cpu',
                'cortex-m7',
                '-nographic',
                '-monitor',
                'none',
            ),
            *('-serial', 'none', '-chardev', 'stdio,id=out', '-semihosting-config', 'enable=on,chardev=out'),
            '-kernel',
        ],
        'gcc-arm-none-eabi qemu-system-arm',
    ),
}


def main(name: str) -> int:
    """Compare both policies on a target; return the exit code."""
    target = TARGETS[name]
    missing = [each[0] for each in (target.compiler, target.emulator) if shutil.which(each[0]) is None]
    if missing:
        print(f'{" and ".join(missing)} not found: apt-get install --no-install-recommends {target.packages}')
        return 2
    for tool in (target.compiler[0], target.emulator[0]):
        print(subprocess.run([tool, '--version'], capture_output=True, text=True).stdout.splitlines()[0])
    equal = True
    for policy in DAMPERS:
        values = {'mount_control': {'policy': policy}}
        with tempfile.TemporaryDirectory() as folder:
            write_controller(values, Path(folder))
            found = hash_on(target, Path(folder), [])
            contracted = hash_on(target, Path(folder), CONTRACTED)
        wanted = f'{sequence_hash(chosen_control(values), SAMPLES):016x}'
        equal = equal and found == wanted != contracted
        print(f'{policy}, {SAMPLES} samples: {found} on {name}, {wanted} by Python, {contracted} contracted')
    return 0 if equal else 1


def hash_on(target: Target, folder: Path, options: list[str]) -> str:
    """Return what the law of `folder` says on a target; 'self-test failed' instead where it says so."""
    program = folder / 'law'
    sources = [HERE / 'law_hash.c', folder / f'{NAME}.c']
    command = [*target.compiler, *FLAGS, *options, '-I', folder, *sources, '-lgcc', '-o', program]
    subprocess.run(command, check=True)
    done = subprocess.run(
        [*target.emulator, program],
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
        stdin=subprocess.DEVNULL,
    )
    return done.stdout.strip()[:16] + ('' if done.returncode == 0 else ' (self-test failed)')


if __name__ == '__main__':
    sys.exit(main(sys.argv[1]))
