"""The desk in Python: recordings, drives, replays and identification of the engine mount, in SI units.

Each name loads what it needs when it is used. What needs no running graph works without ROS.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from mount_recorder import schemas

if TYPE_CHECKING:
    from engine_mount.drives.drive import drive as drive
    from engine_mount.drives.replay import replay as replay
    from engine_mount.experiments.registry import experiment as experiment
    from engine_mount.fleet import Fleet as Fleet
    from engine_mount.identification import calibrate as calibrate
    from engine_mount.identification import identify as identify
    from engine_mount.recordings.access import audit as audit
    from engine_mount.recordings.access import compare as compare
    from engine_mount.recordings.access import open as open
    from engine_mount.reports.report import report as report
    from engine_mount.signals.importing import import_file as import_file
    from engine_mount.signals.roads.driving import road as road

_MODULES = {
    'open': 'recordings.access',
    'audit': 'recordings.access',
    'compare': 'recordings.access',
    'drive': 'drives.drive',
    'replay': 'drives.replay',
    'report': 'reports.report',
    'import_file': 'signals.importing',
    'road': 'signals.roads.driving',
    'identify': 'identification.identify',
    'calibrate': 'identification.calibrate',
    'experiment': 'experiments.registry',
    'Fleet': 'fleet',
}
"""The file of each function; `identify` and `calibrate` are files, with a function for each kind."""

__all__ = list(_MODULES)


def __getattr__(name: str) -> Any:
    if name not in _MODULES:
        raise AttributeError(f'module {__name__!r} has no attribute {name!r}; it has {", ".join(_MODULES)}')
    module = import_module(f'{__name__}.{_MODULES[name]}')
    return getattr(module, name, module)


def _definition_without_ros(type_name: str) -> tuple[str, str] | None:
    """Return text and hash of a message type where ROS is not installed, None of an unknown one."""
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_JAZZY)
    known = type_name in store.fielddefs
    return (
        (store.generate_msgdef(type_name, ros_version=2)[0], store.hash_rihs01(type_name)) if known else None
    )


schemas.other_definitions = _definition_without_ros
