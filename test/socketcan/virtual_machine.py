"""The driver over SocketCAN, in an emulated machine whose kernel has CAN.

`python test/socketcan/virtual_machine.py` boots Debian's own kernel with the root of this machine, read-only.
In it run tests of driver and simulated electronics, and a drive in lock-step, which is compared with the same
drive here on a virtual bus. Exit code: 0 where all passed and the recordings are equal, 1 where not, 2 where
a package is missing.
"""

import lzma
import os
import re
import shlex
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

HERE = Path(__file__).resolve().parent
REPOSITORY = HERE.parents[1]
BUILD = REPOSITORY / 'build' / 'socketcan'
LINUX = BUILD / 'linux'
SHARE = BUILD / 'share'
"""What the machine may write to; it has the same path there."""
BIN = Path(sys.executable).parent

PACKAGES = {'qemu-system-x86_64': 'qemu-system-x86', 'busybox': 'busybox-static', 'cpio': 'cpio'}
MODULES = ('virtio_pci', '9pnet_virtio', '9p', 'can_raw', 'vcan')
LIMIT = 3600  # s, chosen: ten times what a quiet machine of two cores takes
MACHINE = [
    *('qemu-system-x86_64', '-cpu', 'Nehalem', '-smp', '1', '-m', '3G', '-net', 'none'),
    # Time by the count of instructions: time-outs in the machine do not depend on the load of this one.
    *('-accel', 'tcg,thread=single', '-icount', 'shift=1,sleep=on'),
    *('-nographic', '-monitor', 'none', '-serial', 'stdio', '-no-reboot'),
]
KERNEL_OPTIONS = 'console=ttyS0 quiet panic=-1 rcupdate.rcu_cpu_stall_suppress=1 nowatchdog'
ENVIRONMENT = {'NUMBA_CPU_NAME': 'generic', 'XDG_CACHE_HOME': str(SHARE / 'cache')}
"""Laws are compiled here, for any processor of this architecture: in the machine it would take minutes."""

ELECTRONICS = 'src/mount_sim/test/test_hold.py::test_a_frozen_node'
TESTS = [
    *(f'src/mount_driver/test/test_{name}.py' for name in ('exchange', 'senders', 'hold', 'node')),
    *(
        f'src/mount_driver/test/test_bus.py::test_{name}'
        for name in (
            'a_frame_tells_when_it_arrived_not_when_it_was_read[virtual]',
            'frames_with_other_identifiers_are_filtered_out[virtual]',
            'a_burst_of_half_a_second_is_held',
            'error_frames_pass_the_filter',
        )
    ),
    ELECTRONICS,
]
"""Tests of the packages that say nothing of their bus."""
IN_ANOTHER_PROCESS = (
    'src/mount_driver/test/test_exchange.py::test_a_process_that_ends_by_an_exception_sends_0_ampere'
)
"""Its process opens the bus that it names."""
PYTEST = [BIN / 'python', '-m', 'pytest', '-n', '0']
DRIVE = [
    *(BIN / 'engine-mount', 'drive', '--lockstep', '--scenario', 'bench', '--duration', '2', '--no-report'),
    *('--priority', '0', '--set', 'mount_sim.timeline.start=2.9'),
]
OVER_VCAN = ['--set', 'mount_driver.interface=socketcan', '--set', 'mount_driver.channel=vcan0']


def main() -> int:
    """Pass all checks and return the exit code."""
    missing = [package for tool, package in PACKAGES.items() if shutil.which(tool) is None]
    if missing:
        print(f'virtual machine not started: apt-get install --no-install-recommends {" ".join(missing)}')
        return 2
    if not LINUX.exists() and not unpack_kernel():
        print('kernel of Debian not found: apt-get update, on Debian for amd64')
        return 2
    for name in ('virtual', 'socketcan'):
        shutil.rmtree(SHARE / name, ignore_errors=True)
    SHARE.mkdir(parents=True, exist_ok=True)
    environment = {**os.environ, **ENVIRONMENT}
    subprocess.run(
        [*DRIVE, '--out', SHARE / 'virtual'], check=True, env=environment, stdout=subprocess.DEVNULL
    )
    subprocess.run([*PYTEST, '-q', ELECTRONICS], check=True, env=environment, cwd=REPOSITORY)
    if not boot(
        [*DRIVE, *OVER_VCAN, '--out', SHARE / 'socketcan'],
        [*PYTEST, '-v', '-p', 'over_vcan', '--deselect', IN_ANOTHER_PROCESS, HERE / 'checks.py', *TESTS],
    ):
        return 1
    return subprocess.run(
        [BIN / 'engine-mount', 'compare', SHARE / 'socketcan', SHARE / 'virtual']
    ).returncode


def boot(*commands: list[str | Path]) -> bool:
    """Run commands in the machine, one after the other; return whether all ended with exit code 0."""
    path = os.pathsep.join(filter(None, (os.environ.get('PYTHONPATH'), str(HERE))))
    inside = {'PATH': os.environ['PATH'], 'HOME': '/run', 'TMPDIR': '/run', 'PYTHONPATH': path, **ENVIRONMENT}
    lines = [f'export {name}={shlex.quote(value)}' for name, value in inside.items()]
    lines += [
        'set -e',
        f'cd {shlex.quote(str(REPOSITORY))}',
        *(shlex.join(map(str, each)) for each in commands),
    ]
    (SHARE / 'commands').write_text('\n'.join(lines) + '\n')
    code = SHARE / 'exit_code'
    code.unlink(missing_ok=True)
    [kernel] = (LINUX / 'boot').glob('vmlinuz-*')
    shares = {
        'root': 'path=/,readonly=on,multidevs=remap,security_model=none',
        'share': f'path={SHARE},multidevs=remap,security_model=none',
    }
    virtfs = [word for tag, how in shares.items() for word in ('-virtfs', f'local,mount_tag={tag},{how}')]
    machine = [*MACHINE, *virtfs, '-kernel', kernel, '-initrd', initramfs()]
    begin = time.monotonic()
    subprocess.run(
        [*machine, '-append', KERNEL_OPTIONS],
        check=True, timeout=LIMIT, stdin=subprocess.DEVNULL,
    )  # fmt: skip
    print(f'{kernel.name}: {time.monotonic() - begin:.0f} s on this machine')
    return code.exists() and code.read_text().strip() == '0'


def unpack_kernel() -> bool:
    """Unpack the newest kernel of Debian below `build`, which installs nothing; False where there is none."""
    BUILD.mkdir(parents=True, exist_ok=True)
    unpacked = BUILD / 'unpacked'
    try:
        depends = subprocess.run(
            ['apt-cache', 'depends', 'linux-image-amd64'], check=True, capture_output=True, text=True
        )
        [package] = re.findall(r'Depends: (linux-image-\S+)', depends.stdout)
        subprocess.run(['apt-get', 'download', package], cwd=BUILD, check=True)
        [archive] = BUILD.glob(f'{package}_*.deb')
        subprocess.run(['dpkg-deb', '-x', archive, unpacked], check=True)
    except (OSError, subprocess.CalledProcessError, ValueError):
        return False
    archive.unlink()
    unpacked.rename(LINUX)
    return True


def initramfs() -> Path:
    """Return an archive with busybox, `init`, and the modules of the kernel in the order of loading."""
    tree = BUILD / 'initramfs'
    shutil.rmtree(tree, ignore_errors=True)
    for folder in ('bin', 'proc', 'host', 'modules'):
        (tree / folder).mkdir(parents=True)
    shutil.copy(str(shutil.which('busybox')), tree / 'bin' / 'busybox')
    shutil.copy(HERE / 'init', tree / 'init')
    (tree / 'init').chmod(0o755)
    (tree / 'writable').write_text(str(SHARE))
    files = {path.name.partition('.')[0].replace('-', '_'): path for path in LINUX.rglob('*.ko*')}
    order = dict.fromkeys(needed for name in MODULES for needed in load_order(name, files))
    for name in order:
        (tree / 'modules' / name).write_bytes(module(files[name]))
    (tree / 'modules' / 'order').write_text(''.join(f'{name}\n' for name in order))
    names = ''.join(f'{path.relative_to(tree)}\n' for path in sorted(tree.rglob('*')))
    archive = BUILD / 'initramfs.cpio'
    with archive.open('wb') as out:
        command = ['cpio', '--quiet', '-o', '-H', 'newc']
        subprocess.run(command, cwd=tree, input=names.encode(), stdout=out, check=True)
    return archive


def load_order(name: str, files: dict[str, Path]) -> Iterator[str]:
    """Yield the modules that `name` needs, then itself; what is part of the kernel has no file."""
    if name in files:
        depends = re.search(rb'\0depends=([^\0]*)\0', module(files[name]))
        for needed in filter(None, depends[1].decode().split(',') if depends else ()):
            yield from load_order(needed.replace('-', '_'), files)
        yield name


def module(file: Path) -> bytes:
    """Return a module of the kernel, unpacked."""
    content = file.read_bytes()
    return lzma.decompress(content) if file.suffix == '.xz' else content


if __name__ == '__main__':
    sys.exit(main())
