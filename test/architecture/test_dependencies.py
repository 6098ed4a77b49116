"""Every package.xml, the requirement files and the imports name the same libraries."""

import re
import sys
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from xml.etree import ElementTree

import pytest
from libraries import LIBRARIES, ROS
from sources import PACKAGES, REPOSITORY, ROS_PACKAGES, SOURCES, modules_of

from mount_bringup.graph.nodes import SIMULATED
from mount_ros.topics import RACK_TOPICS, TOPICS

COMMANDS = {'ros2launch'}  # called by their name
UNSEEN = {  # what is needed without an import that can be seen
    'mount_ros': {topic.type.split('/')[0] for topic in TOPICS + RACK_TOPICS},
    'mount_driver': {'msgpack'},  # of python-can, for frames by multicast
    'mount_bringup': COMMANDS | {node.name for node in SIMULATED},
}


@pytest.mark.parametrize('package', ROS_PACKAGES)
def test_a_package_names_what_its_code_imports_and_nothing_else(package):
    needed = keys(imported(code_of(package)) | UNSEEN.get(package, set()))
    assert declared(package, 'exec_depend') == needed - {package}


@pytest.mark.parametrize('package', ROS_PACKAGES)
def test_a_package_names_what_its_tests_import_besides(package):
    code = declared(package, 'exec_depend')
    assert declared(package, 'test_depend') == keys(imported(own_tests_of(package))) - code - {package}


def test_where_there_is_no_ros_the_requirements_pin_what_the_code_imports_and_nothing_else():
    assert pinned('requirements.txt') | pinned('requirements-desk.txt') == projects(code_of)


def test_a_desk_without_ros_lacks_only_what_has_no_wheels_for_aarch64():
    assert pinned('requirements.txt') - pinned('requirements-core.txt') == {'autosar-e2e'}
    assert pinned('requirements-car.txt') - pinned('requirements-core.txt') == {'autosar-e2e'}


def test_the_requirements_of_tests_pin_what_tests_import():
    assert projects(own_tests_of) <= pinned('requirements-dev.txt')


def code_of(package: str) -> list[Path]:
    """Return the sources of a package; the plugin for tests is one of them only where it lies."""
    files = [*(SOURCES / package / package).rglob('*.py'), *(SOURCES / package / 'launch').glob('*.py')]
    return [file for file in files if not {'testing.py', 'testing'} & set(file.parts)]


def own_tests_of(package: str) -> list[Path]:
    own = SOURCES / package / package
    return [*(SOURCES / package / 'test').rglob('*.py'), *own.glob('testing.py'), *own.glob('testing/*.py')]


def imported(files: Sequence[Path]) -> set[str]:
    """Return the packages that files import, without Python's own and what tests keep beside themselves."""
    beside = {
        path.stem for file in files for path in file.parent.glob('*.py') if 'test' in file.parent.parts[-2:]
    }
    support = {path.stem for path in (SOURCES.parent / 'test' / 'support').glob('*.py')}
    found = {module.split('.')[0] for file in files for module in modules_of(file)}
    return found - support - beside - sys.stdlib_module_names


def keys(modules: Iterable[str]) -> set[str]:
    """Return the names in package.xml; what rosdep does not know has none."""
    libraries = {module: LIBRARIES[module].key for module in modules if module in LIBRARIES}
    others = set(modules) - set(libraries) - {'engine_mount'}  # which pip installs
    unknown = others - ROS - set(PACKAGES) - COMMANDS
    assert not unknown, f'{unknown}: say in libraries.py where an installation gets them from'
    return others | {key for key in libraries.values() if key}


def declared(package: str, kind: str) -> set[str]:
    """Return what a package.xml names as `kind`, such as exec_depend."""
    root = ElementTree.parse(SOURCES / package / 'package.xml').getroot()
    names = [str(element.text) for element in root.iter(kind)]
    assert len(names) == len(set(names)), f'{package}/package.xml names one twice'
    return set(names)


def projects(files_of) -> set[str]:
    """Return the projects on PyPI that the files of all packages need, those of ROS aside."""
    modules = {module for package in PACKAGES for module in imported(files_of(package))}
    modules |= {name for names in UNSEEN.values() for name in names} if files_of is code_of else set()
    return {LIBRARIES[module].project for module in modules if module in LIBRARIES}


def pinned(name: str) -> set[str]:
    return {project for project in _requirements(REPOSITORY / name) if not project.startswith('ros-jazzy-')}


def _requirements(file: Path) -> Iterator[str]:
    for line in file.read_text().splitlines():
        if line.startswith('-r '):
            yield from _requirements(file.with_name(line.removeprefix('-r ')))
        elif line and not line.startswith('#'):
            project, _ = re.fullmatch(r'([\w-]+)(?:\[[\w,]+\])?==(.+)', line).groups()
            yield project
