"""The arrows between the packages point one way."""

from collections.abc import Iterator
from graphlib import TopologicalSorter
from pathlib import Path

import pytest
from loaded_modules import modules_after
from sources import PACKAGES, ROS_PACKAGES, SOURCES, module_files, modules_of

FLOORS = (
    ('mount_models',),
    ('mount_ros',),
    ('mount_driver', 'mount_init', 'mount_control', 'mount_recorder'),
    ('mount_sim',),
    ('mount_bringup',),
    ('engine_mount.recordings',),
    ('engine_mount.settings',),
    ('engine_mount.signals',),
    (
        'engine_mount.drives',
        'engine_mount.export',
        'engine_mount.faults',
        'engine_mount.identification',
        'engine_mount.reports',
    ),
    ('engine_mount.fleet',),
    ('engine_mount.experiments', 'engine_mount.view'),
    ('engine_mount.cli',),
)
"""Packages, and rooms of the desk's one package, from the ground up; none imports one beside or above it."""
CAR = {
    *('mount_models', 'mount_ros', 'mount_driver', 'mount_init', 'mount_control', 'mount_recorder'),
    *('mount_sim', 'mount_bringup'),
}
MAY_IMPORT = {
    package: {below for lower in FLOORS[:level] for below in lower}
    for level, floor in enumerate(FLOORS)
    for package in floor
}
ROS = ('rclpy', 'sensor_msgs', 'std_msgs', 'diagnostic_msgs', 'geometry_msgs', 'lifecycle_msgs', 'mount_ros')
REGISTRY = 'mount_ros.topics'  # plain data, which any file may read
# Beside node.py: verdicts are `mount_ros.nodes.diagnostics.Verdict`, plain data.
MAY_TOUCH_ROS = {
    'mount_driver': {'node.py', 'health.py'},
    'mount_init': {'node.py'},
    'mount_control': {'node.py', 'diagnosis.py'},
    'mount_sim': {'node.py', 'diagnosis.py', 'loop.py'},
}


@pytest.mark.parametrize('package', MAY_IMPORT)
def test_packages_import_only_what_lies_below_them(package: str):
    modules = {module for file in _files(package) for module in modules_of(file)}
    assert _ours(modules) - {package} <= MAY_IMPORT[package]


def test_no_module_needs_itself_by_way_of_others():
    files = module_files()
    needs = {module: set(modules_of(file)) & set(files) for module, file in files.items()}
    assert 'mount_models.quantity' in needs['mount_models.specimen']  # such arrows are seen
    tuple(TopologicalSorter(needs).static_order())  # raises CycleError, which names the circle


def test_every_package_is_covered():
    rooms = {file.parent.name for file in (SOURCES / 'engine_mount' / 'engine_mount').glob('*/__init__.py')}
    assert {*ROS_PACKAGES, *(f'engine_mount.{room}' for room in rooms)} == set(MAY_IMPORT)


@pytest.mark.parametrize('package', MAY_TOUCH_ROS)
def test_only_the_node_and_its_verdict_touch_ros(package: str):
    files = (SOURCES / package / package).rglob('*.py')
    assert {file.name for file in files if _touches_ros(file)} == MAY_TOUCH_ROS[package]


def test_the_registry_of_topics_is_plain_data():
    assert not _touches_ros(SOURCES / 'mount_ros' / 'mount_ros' / 'topics.py')


def test_models_know_no_ros():
    modules = {name.split('.')[0] for file in _files('mount_models') for name in modules_of(file)}
    assert not modules & set(ROS)


def test_the_command_loads_what_it_needs_once_it_knows_what_is_wanted():
    loaded = modules_after('import engine_mount.cli.command')
    assert not {'numpy', 'scipy', 'numba', 'matplotlib', 'rclpy', 'mcap'} & loaded


def test_no_node_loads_what_only_files_of_others_need():
    """Where asammdf is installed, python-can loads it, and each node would start 4 s later."""
    nodes = ', '.join(f'{package}.node' for package in MAY_TOUCH_ROS)
    loaded = modules_after(f'import {nodes}, mount_recorder.node, engine_mount.drives.drive')
    assert not {'asammdf', 'pandas', 'pyarrow', 'fsspec', 'dask'} & loaded


def test_the_front_door_of_foreign_files_loads_the_reader_of_recordings_only_for_one():
    loaded = modules_after('import engine_mount.signals.formats.reading')
    assert not {'engine_mount.recordings', 'pydantic', 'rosbags', 'yaml'} & loaded


def test_python_can_is_loaded_in_one_place():
    files = [file for package in PACKAGES for file in (SOURCES / package).rglob('*.py')]
    loading = {
        file.name for file in files if {'can', 'cantools'} & {name.split('.')[0] for name in modules_of(file)}
    }
    assert loading == {'can_library.py'}


def test_the_fits_of_the_actuator_never_see_the_truth():
    """Nor do driver, initialisation and controller: their packages lie below `mount_sim`."""
    fits = SOURCES / 'engine_mount' / 'engine_mount' / 'identification'
    modules = {module for file in fits.glob('force_*.py') for module in modules_of(file)}
    assert 'mount_models.actuator' in modules
    assert not {module for module in modules if module.startswith('mount_sim')}


def _files(package: str) -> Iterator[Path]:
    name, _, room = package.partition('.')
    yield from sorted((SOURCES / name / name / room).rglob('*.py'))


def _ours(modules: set[str]) -> set[str]:
    """Return which packages and rooms `modules` belong to."""
    units = {'.'.join(name.split('.')[: 1 + name.startswith('engine_mount.')]) for name in modules}
    return units & set(MAY_IMPORT)


def _touches_ros(file: Path) -> bool:
    modules = {name for name in modules_of(file) if name != REGISTRY and not name.startswith(f'{REGISTRY}.')}
    return bool({name.split('.')[0] for name in modules} & set(ROS))
