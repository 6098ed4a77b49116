"""What the instruments of a simulated rack measured, as a recording in the topics of a drive."""

import time
from collections.abc import Mapping
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from geometry_msgs.msg import WrenchStamped
from std_msgs.msg import String

from mount_bags.writer import BagWriter
from mount_bringup.drive import versions
from mount_bringup.supervisor import session_text
from mount_ros.cdr import serialised
from mount_ros.scalars import OneNumberLayout, ScalarsLayout
from mount_ros.topics import (
    DISPLACEMENT,
    SAMPLE_RATE,
    SESSION,
    SIM_CLAMP_FORCE,
    SIM_MOUNT_FORCE,
    Delivery,
)

FloatArray = npt.NDArray[np.float64]

_SAMPLE_NANOSECONDS = round(1e9 / SAMPLE_RATE)
_TOPICS = (SESSION, DISPLACEMENT, SIM_MOUNT_FORCE, SIM_CLAMP_FORCE)


def record_friction_rack(
    folder: Path,
    displacement: FloatArray,
    friction_force: FloatArray,
    normal_force: FloatArray,
    session: Mapping[str, Any],
) -> Path:
    """Write what the friction rack measured at 1 kHz and return the recording; arrays (n,), m and N.

    The rack has no elastomer, so its `sim/mount_force` is the friction force alone. `session` says what was
    done; times and versions are added.
    """
    writer = BagWriter(folder)
    begin = time.time_ns()
    try:
        for topic in _TOPICS:
            writer.add_topic(f'/{topic.name}', topic.type, latched=topic.delivery is Delivery.LATCHED)
        writer.write(f'/{SESSION.name}', _session(session), begin)
        positions = ScalarsLayout(DISPLACEMENT)
        forces = OneNumberLayout(WrenchStamped(), 'wrench.force.z')
        rows = zip(displacement.tolist(), friction_force.tolist(), normal_force.tolist(), strict=True)
        for sample, (x, friction, clamp) in enumerate(rows):
            stamp = sample * _SAMPLE_NANOSECONDS
            at = begin + stamp
            writer.write(f'/{DISPLACEMENT.name}', positions.pack(stamp, (x,)), at)
            writer.write(f'/{SIM_MOUNT_FORCE.name}', forces.pack(stamp, friction), at)
            writer.write(f'/{SIM_CLAMP_FORCE.name}', forces.pack(stamp, clamp), at)
    finally:
        writer.close()
    return folder


def _session(content: Mapping[str, Any]) -> bytes:
    started = datetime.now().astimezone().isoformat(timespec='seconds')
    return serialised(String(data=session_text({**content, 'started': started, 'versions': versions()})))
