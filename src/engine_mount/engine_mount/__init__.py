"""The desk: works on recordings and simulations of the engine mount."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from mount_recorder import schemas

if TYPE_CHECKING:
    from engine_mount.recordings import Recording


def open(path: str | os.PathLike[str]) -> Recording:
    """Return the recording at `path`, a folder or one file; raises `ReadingError`."""
    from engine_mount.recordings import open_recording  # only here: an import of the package stays cheap

    return open_recording(path)


def _definition_without_ros(type_name: str) -> tuple[str, str] | None:
    """Return text and hash of a message type where ROS is not installed, None of an unknown one."""
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_JAZZY)
    known = type_name in store.fielddefs
    return (
        (store.generate_msgdef(type_name, ros_version=2)[0], store.hash_rihs01(type_name)) if known else None
    )


schemas.other_definitions = _definition_without_ros
