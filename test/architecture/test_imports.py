"""The arrows between the packages point one way."""

import subprocess
import sys
from collections.abc import Iterator
from graphlib import TopologicalSorter
from pathlib import Path

import pytest
from sources import PACKAGES, SOURCES, module_files, modules_of

CAR = (
    ('mount_models',),
    ('mount_ros',),
    ('mount_driver', 'mount_init', 'mount_control', 'mount_bags'),
    ('mount_sim',),
    ('mount_bringup',),
)
DESK = (
    ('mount_signals',),
    ('mount_replay', 'mount_identification', 'mount_report'),
    ('mount_experiments', 'mount_view'),
    ('mount_cli',),
)
FLOORS = (*CAR, *DESK)
"""The packages from the ground up; none imports one beside it or above it."""
MAY_IMPORT = {
    package: {below for lower in FLOORS[:level] for below in lower}
    for level, floor in enumerate(FLOORS)
    for package in floor
}
ROS = ('rclpy', 'sensor_msgs', 'std_msgs', 'diagnostic_msgs', 'geometry_msgs', 'lifecycle_msgs', 'mount_ros')
REGISTRY = 'mount_ros.topics'  # plain data, which any file may read
# Beside node.py: verdicts are `mount_ros.nodes.diagnostics.Verdict`, plain data.
MAY_TOUCH_ROS = {
    'mount_driver': {'node.py', 'diagnosis.py'},
    'mount_init': {'node.py'},
    'mount_control': {'node.py', 'diagnosis.py'},
    'mount_sim': {'node.py', 'diagnosis.py', 'loop.py'},
}


@pytest.mark.parametrize('package', MAY_IMPORT)
def test_packages_import_only_what_lies_below_them(package: str):
    ours = {name for _, name in _imports(package) if name in MAY_IMPORT}
    assert ours - {package} <= MAY_IMPORT[package]


@pytest.mark.parametrize('package', MAY_IMPORT)
def test_tests_of_a_package_import_only_what_lies_below_it(package: str):
    """Else a build of all packages finds no order."""
    modules = {module for file in (SOURCES / package / 'test').glob('*.py') for module in modules_of(file)}
    ours = {module.split('.')[0] for module in modules} & set(MAY_IMPORT)
    assert ours - {package} <= MAY_IMPORT[package]


def test_no_module_needs_itself_by_way_of_others():
    files = module_files()
    needs = {module: set(modules_of(file)) & set(files) for module, file in files.items()}
    assert 'mount_models.quantity' in needs['mount_models.specimen']  # such arrows are seen
    tuple(TopologicalSorter(needs).static_order())  # raises CycleError, which names the circle


def test_rooms_of_mount_bags_stand_one_upon_another():
    files = {name: file for name, file in module_files().items() if name.count('.') == 2}
    rooms: dict[str, set[str]] = {}
    for module, file in files.items():
        room = module.rpartition('.')[0]
        others = {name.rpartition('.')[0] for name in modules_of(file) if name in files}
        rooms.setdefault(room, set()).update(others - {room})
    of_bags = {room: others for room, others in rooms.items() if room.startswith('mount_bags.')}
    assert 'mount_bags.container' in of_bags['mount_bags.bag']
    tuple(TopologicalSorter(of_bags).static_order())  # raises CycleError, which names the circle


def test_every_package_is_covered():
    assert set(PACKAGES) == set(MAY_IMPORT)


@pytest.mark.parametrize('package', MAY_TOUCH_ROS)
def test_only_the_node_and_its_verdict_touch_ros(package: str):
    files = (SOURCES / package / package).rglob('*.py')
    assert {file.name for file in files if _touches_ros(file)} == MAY_TOUCH_ROS[package]


def test_the_registry_of_topics_is_plain_data():
    assert not _touches_ros(SOURCES / 'mount_ros' / 'mount_ros' / 'topics.py')


def test_models_know_no_ros():
    assert not [str(file) for file, name in _imports('mount_models') if name in ROS]


def test_the_command_loads_what_it_needs_once_it_knows_what_is_wanted():
    tell = 'import sys, mount_cli.command; print(*sys.modules)'
    loaded = subprocess.run([sys.executable, '-c', tell], capture_output=True, text=True, check=True).stdout
    assert not {'numpy', 'scipy', 'numba', 'matplotlib', 'rclpy', 'mcap'} & set(loaded.split())


def test_no_node_loads_what_only_files_of_others_need():
    """Where asammdf is installed, python-can loads it, and each node would start 4 s later."""
    nodes = ', '.join(f'{package}.node' for package in MAY_TOUCH_ROS)
    tell = f'import sys, {nodes}, mount_bags.node, mount_replay.drive.drive; print(*sys.modules)'
    loaded = subprocess.run([sys.executable, '-c', tell], capture_output=True, text=True, check=True).stdout
    assert not {'asammdf', 'pandas', 'pyarrow', 'fsspec', 'dask'} & set(loaded.split())


def test_python_can_is_loaded_in_one_place():
    files = [file for package in PACKAGES for file in (SOURCES / package).rglob('*.py')]
    loading = {
        file.name for file in files if {'can', 'cantools'} & {name.split('.')[0] for name in modules_of(file)}
    }
    assert loading == {'can_library.py'}


def test_the_controller_never_sees_the_truth():
    truth = {
        'mount_models.actuator.reluctance',
        'mount_models.actuator.closing',
        'mount_models.coil.ripple',
        'mount_models.elastomer',
        'mount_models.hydromount',
        'mount_models.vehicle',
        'mount_models.energy',
        'mount_sim',
    }
    fits = SOURCES / 'mount_identification' / 'mount_identification' / 'actuator'
    for folder in (
        *(SOURCES / name / name for name in ('mount_control', 'mount_init', 'mount_driver')),
        fits,
    ):
        modules = {module for file in folder.rglob('*.py') for module in modules_of(file)}
        assert modules
        seen = {module for module in modules if any(module.startswith(name) for name in truth)}
        assert not seen, f'{folder} imports {seen}'


def _imports(package: str) -> Iterator[tuple[Path, str]]:
    for file in sorted((SOURCES / package / package).rglob('*.py')):
        for module in modules_of(file):
            yield file, module.split('.')[0]


def _touches_ros(file: Path) -> bool:
    modules = {name for name in modules_of(file) if name != REGISTRY and not name.startswith(f'{REGISTRY}.')}
    return bool({name.split('.')[0] for name in modules} & set(ROS))
