"""The Python product on an emulated aarch64: bytes of laws, drives and replays beside those made here.

`python test/targets/aarch64.py`: exit code 0 where all are equal, 1 where one is not, 2 where a package is
missing. Both sides are a desk without ROS, with the wheels of requirements-core.txt: here in an environment
of its own; there with packages of Debian for arm64, from where apt takes those of this machine. All of it
lies in build/aarch64, and downloads serve later runs. The emulator is registered in a namespace of its own
(kernel 6.7 or later), so nothing changes outside.
"""

import hashlib
import json
import platform
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

REPOSITORY = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(REPOSITORY / 'test' / 'replay'))
from made_here import differences_of  # noqa: E402

BUILD = REPOSITORY / 'build' / 'aarch64'
TREE, VENV = BUILD / 'tree', BUILD / 'venv'
PIP = (VENV / 'bin' / 'python', '-m', 'pip', 'install', '-qq', '--disable-pip-version-check')
REQUIREMENTS = REPOSITORY / 'requirements-core.txt'
PROGRAMS = {
    'qemu-aarch64-static': 'qemu-user-static',
    'apt-get': 'apt',
    'dpkg-deb': 'dpkg',
    'unshare': 'util-linux',
}
"""{program: package of Debian}."""
PACKAGES = ('python3', 'libgomp1', 'libstdc++6')  # with what they need
PROCESSOR = 'neoverse-n1'  # chosen: a server's, with fused instructions
C_LIBRARIES = range(
    17, int(platform.libc_ver()[1].split('.')[1]) + 1
)  # 2.17, manylinux2014, to this machine's
LIMIT = 3600.0  # s: only a hang takes so long
ELF = (
    r'\x7fELF\x02\x01\x01\x00\x00\x00\x00\x00\x00\x00\x00\x00\x02\x00\xb7\x00'
    r':\xff\xff\xff\xff\xff\xff\xff\x00\xff\xff\xff\xff\xff\xff\xff\xff\xfe\xff\xff\xff'
)
"""Beginning and mask of programs for aarch64: 64 bits, little-endian, machine 183."""
ENTER = f"""set -e
mount -t binfmt_misc none /proc/sys/fs/binfmt_misc
emulator=$(command -v qemu-aarch64-static)
printf %s ':aarch64:M::{ELF}:'"$emulator:F" > /proc/sys/fs/binfmt_misc/register
for each in proc dev sys; do mount --rbind "/$each" "$0/$each"; done
mount --bind "$1" "$0/repository"
mount --bind "$2" "$0/out"
shift 2
exec chroot "$0" "$@"
"""
"""Arguments: tree, repository, folder of the results, then the command."""
COMMAND = ('-P', '-c', 'from engine_mount.cli.start import main; main()')


class Desk(NamedTuple):
    """Where the product runs: Python as a command, its library path, and paths as it sees them."""

    name: str
    python: Sequence[str | Path]
    wheels: str
    repository: Path
    out: Path

    @property
    def results(self) -> Path:
        """The folder of the results as seen from here."""
        return BUILD / self.name / 'results'

    def run(self, what: str, *arguments: str | Path) -> str:
        """Return what Python prints with `arguments`, and print how long it took."""
        packages = [
            str(self.repository / 'src' / each.name) for each in sorted((REPOSITORY / 'src').iterdir())
        ]
        environment = {
            'PATH': '/usr/bin:/bin:/usr/sbin:/sbin',
            'PYTHONPATH': ':'.join([*packages, self.wheels]).rstrip(':'),
            'HOME': str(self.out),
            'LANG': 'C.UTF-8',
            'QEMU_CPU': PROCESSOR,
        }
        begin = time.monotonic()
        done = subprocess.run(
            [*self.python, *arguments],
            env=environment, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=LIMIT,
        )  # fmt: skip
        if done.returncode:
            sys.exit(f'{what} on {self.name} ended with {done.returncode}:\n{done.stdout}{done.stderr}')
        print(f'{self.name:<8} {what:<42} {time.monotonic() - begin:6.1f} s', flush=True)
        return done.stdout

    def work(self) -> dict[str, Any]:
        """Make all results; return what `made_here` says."""
        shutil.rmtree(self.results, ignore_errors=True)
        self.results.mkdir(parents=True)
        results, references = self.out / 'results', self.repository / 'bags' / 'reference'
        script = self.repository / 'test' / 'replay' / 'made_here.py'
        said = self.run('laws, drives, references', '-P', script, results / 'made', references)
        drive, replayed = results / 'drive', results / 'replayed'
        for command in (
            ('drive', '--core', '--duration', '2', '--out', drive),
            ('replay', drive, '--out', replayed),
            ('audit', drive),
            ('report', drive),
        ):
            self.run(f'engine-mount {command[0]}', *COMMAND, *command)
        return json.loads(said.splitlines()[-1])


def main() -> int:
    """Compare; return the exit code."""
    missing = {package for program, package in PROGRAMS.items() if shutil.which(program) is None}
    if missing:
        print(f'a program is missing: apt-get install --no-install-recommends {" ".join(sorted(missing))}')
        return 2
    made_once(VENV, [sys.version, REQUIREMENTS.read_text()], make_environment)
    made_once(TREE, [*PACKAGES, platform.platform()], make_tree)
    version = max(path.name for path in TREE.glob('usr/bin/python3.*')).removeprefix('python')
    wheels = [version, REQUIREMENTS.read_text()]
    made_once(TREE / 'wheels', wheels, lambda folder: install_wheels(folder, version))
    emulator = subprocess.check_output(['qemu-aarch64-static', '--version'], text=True).splitlines()[0]
    print(f'{emulator}, {PROCESSOR}', flush=True)
    inside = ['unshare', '--user', '--map-root-user', '--mount', 'sh', '-c', ENTER, TREE, REPOSITORY]
    there = BUILD / 'aarch64'
    desks = (
        Desk('x86_64', [VENV / 'bin' / 'python'], '', REPOSITORY, BUILD / 'x86_64'),
        Desk('aarch64', [*inside, there, '/usr/bin/python3'], '/wheels', Path('/repository'), Path('/out')),
    )
    said = {desk.name: desk.work() for desk in desks}
    results = [desk.results for desk in desks]
    paths = [str(path.parent.relative_to(results[0])) for path in sorted(results[0].rglob('metadata.yaml'))]
    for name, each in said.items():
        known = {**each['versions'], 'numba for': each['seen']['numba'], **each['laws']}
        known |= {'products not rounded': each['fused'], 'where permitted': each['fused_if_permitted']}
        print(f'{name}: {", ".join(f"{what} {value}" for what, value in known.items())}')
    found = [text for name, each in said.items() for text in complaints(name, each)]
    if said['x86_64']['laws'] != said['aarch64']['laws']:
        found.append('the laws have other hashes')
    found += differences_of(*results, paths)
    print(*(found or [f'equal to the byte: all numbers, and recordings {", ".join(paths)}']), sep='\n')
    return 1 if found else 0


def complaints(name: str, said: dict[str, Any]) -> list[str]:
    """Return what was not as it should be on one side, in words."""
    found = [
        f'{name}: the replay of {each} is not what was recorded'
        for each, met in said['met'].items()
        if not met
    ]
    if said['fused'] or not said['fused_if_permitted']:
        found.append(
            f'{name}: {said["fused"]} products are not rounded before their sum, and '
            f'{said["fused_if_permitted"]} where that is permitted; wanted are 0, and more than 0'
        )
    return found


def made_once(folder: Path, causes: Sequence[str], make: Callable[[Path], None]) -> None:
    """Make a folder anew unless it was made from the same `causes`."""
    mark, digest = (
        folder.with_name(f'{folder.name}.made'),
        hashlib.sha256('\n'.join(causes).encode()).hexdigest(),
    )
    if mark.exists() and mark.read_text() == digest:
        return
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    begin = time.monotonic()
    make(folder)
    mark.write_text(digest)
    print(f'{folder.relative_to(REPOSITORY)} made in {time.monotonic() - begin:.0f} s', flush=True)


def make_tree(tree: Path) -> None:
    """Unpack `PACKAGES` for arm64, from the sources of this machine's apt, whose state stays untouched."""
    apt = BUILD / 'apt'
    for folder in ('lists/partial', 'archives/partial'):
        (apt / folder).mkdir(parents=True, exist_ok=True)
    (apt / 'status').touch()
    options = {
        **dict.fromkeys(('APT::Architecture', 'APT::Architectures'), 'arm64'),
        'Dir::State::status': apt / 'status',
        'Dir::State': apt,
        'Dir::Cache': apt,
        'APT::Sandbox::User': 'root',
    }
    command = ['apt-get', '--quiet=2', *(f'--option={name}={value}' for name, value in options.items())]
    subprocess.run([*command, 'update'], check=True)
    wanted = ['install', '--yes', '--no-install-recommends', '--download-only', *PACKAGES]
    subprocess.run([*command, *wanted], check=True)
    for package in (apt / 'archives').glob('*.deb'):
        subprocess.run(['dpkg-deb', '--extract', package, tree], check=True)
    for each in ('bin', 'lib', 'sbin'):  # a distribution that has all in usr links these when it is set up
        if not (tree / each).exists():
            (tree / each).symlink_to(f'usr/{each}')
    for each in ('proc', 'dev', 'sys', 'tmp', 'repository', 'out'):
        (tree / each).mkdir(exist_ok=True)


def install_wheels(folder: Path, version: str) -> None:
    """Install the wheels for aarch64 and a version of Python."""
    platforms = ['manylinux2014_aarch64', *(f'manylinux_2_{number}_aarch64' for number in C_LIBRARIES)]
    subprocess.run(
        [
            *PIP,
            *('--only-binary=:all:', '--python-version', version, '--target', folder, '-r', REQUIREMENTS),
            *(f'--platform={name}' for name in platforms),
        ],
        check=True,
    )


def make_environment(folder: Path) -> None:
    """Make the environment of a desk without ROS on this machine."""
    subprocess.run([sys.executable, '-m', 'venv', folder], check=True)
    subprocess.run([*PIP, '-r', REQUIREMENTS], check=True)


if __name__ == '__main__':
    sys.exit(main())
