"""What runs in the car loads nothing of the desk, and the lines of the README install what it loads."""

import re
import subprocess
import sys
from pathlib import Path

import pytest
from libraries import LIBRARIES
from sources import PACKAGES, REPOSITORY, SOURCES, files_behind, module_files, modules_of
from test_imports import CAR

from mount_bringup.graph.nodes import SIMULATED

LAUNCH_FILES = sorted((SOURCES / 'mount_bringup' / 'launch').glob('*.launch.py'))
SUPERVISORS = ['mount_bringup.graph.run']
MODULES = [*(f'{node.name}.node' for node in SIMULATED), *SUPERVISORS]
BEGIN = [*LAUNCH_FILES, *(module_files()[name] for name in MODULES)]

LOAD = """
import importlib.util, runpy, sys
from unittest.mock import MagicMock

class Absent:
    def find_spec(self, name, path=None, target=None):
        if name in desk or name.split('.')[0] in desk:
            raise ModuleNotFoundError(f'{name} is of the desk', name=name)

wanted, launch, desk = (argument.split() for argument in sys.argv[1:])
sys.meta_path.insert(0, Absent())
if importlib.util.find_spec('launch') is None:  # it comes with a ROS installation
    sys.modules.update(dict.fromkeys(launch, MagicMock()))
for name in wanted:
    runpy.run_path(name) if name.endswith('.py') else importlib.import_module(name)
"""


@pytest.mark.parametrize('wanted', [*map(str, LAUNCH_FILES), *MODULES], ids=lambda name: Path(name).name)
def test_what_the_car_starts_loads_where_nothing_of_the_desk_is_installed(wanted):
    car = files_behind(BEGIN)
    ours = {name for name, file in module_files().items() if file not in car}
    desk = ours | set(LIBRARIES) - libraries_of_the_car()
    assert {'matplotlib', 'skfem', 'typer', 'rich', 'engine_mount.cli.command'} <= desk
    launch = {module for file in car for module in modules_of(file) if module.startswith('launch')}
    arguments = [' '.join(sorted(names)) for names in ({wanted}, launch, desk)]
    command = [sys.executable, '-c', LOAD, *arguments]
    ended = subprocess.run(command, cwd=REPOSITORY, capture_output=True, text=True)
    assert ended.returncode == 0, ended.stderr


START_OF_A_VEHICLE = """
import runpy, sys
from unittest.mock import MagicMock
sys.modules.update(dict.fromkeys(sys.argv[2].split(), MagicMock()))
runpy.run_path(sys.argv[1])['generate_launch_description']()
from mount_bringup.graph.order import launch_order
launch_order(['vehicle', 'recording:=none', 'policy:=switched_viscous'])
print(*sys.modules)
"""


def test_a_launch_of_the_vehicle_loads_neither_simulator_nor_desk_nor_reader_of_recordings():
    [launch_file] = [file for file in LAUNCH_FILES if file.name == 'vehicle.launch.py']
    launch = set(modules_of(module_files()['mount_bringup.graph.launch']))
    stand_ins = ' '.join(
        sorted(name for name in launch if name.split('.')[0] in ('launch', 'ament_index_python'))
    )
    command = [sys.executable, '-c', START_OF_A_VEHICLE, str(launch_file), stand_ins]
    loaded = subprocess.run(
        command, cwd=REPOSITORY, capture_output=True, text=True, check=True
    ).stdout.split()
    assert 'mount_bringup.graph.supervisor' in loaded
    assert not {name.split('.')[0] for name in loaded} & ({*PACKAGES} - CAR | {'mount_sim', 'rosbags'})
    assert not {'mcap.reader', 'scipy.optimize', 'scipy.integrate', 'scipy.signal'} & {*loaded}


def test_what_the_car_loads_and_rosdep_cannot_install_is_in_the_file_that_the_readme_names():
    by_pip = {LIBRARIES[name].project for name in libraries_of_the_car() if not LIBRARIES[name].key}
    pinned = re.findall(r'^([\w-]+)==', (REPOSITORY / 'requirements-car.txt').read_text(), re.MULTILINE)
    assert set(pinned) == by_pip
    assert 'python3 -m pip install -r requirements-car.txt' in lines_for_the_car()


def test_rosdep_is_given_the_packages_of_the_car_and_they_name_no_library_of_the_desk():
    (rosdep,) = [line for line in lines_for_the_car() if line.startswith('rosdep install')]
    words = subprocess.check_output(['bash', '-c', f'echo {rosdep}'], text=True).split()
    packages = {Path(word).name for word in words if word.startswith('src/')}
    assert packages == CAR
    declared = {
        key
        for package in packages
        for key in re.findall(
            '<exec_depend>(.+)</exec_depend>', (SOURCES / package / 'package.xml').read_text()
        )
    }
    assert not declared & {LIBRARIES[name].key for name in set(LIBRARIES) - libraries_of_the_car()}


def libraries_of_the_car() -> set[str]:
    """Return what the car's files import, inside functions too, and what python-can needs for multicast."""
    imported = {module.split('.')[0] for file in files_behind(BEGIN) for module in modules_of(file)}
    return imported & set(LIBRARIES) | {'msgpack'}


def lines_for_the_car() -> list[str]:
    section = (REPOSITORY / 'README.md').read_text().split('\n## In the car\n')[1].split('\n## ')[0]
    return [line for block in section.split('```')[1::2] for line in block.strip().splitlines()]
