"""What the instruments of a simulated rack measured, as a recording in the topics of a drive."""

import time
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

from mount_models.quantity import Quantity
from mount_models.sampling import SAMPLE_TIME_NS
from mount_recorder.bag_writer import BagWriter
from mount_recorder.mcap_writer import LONG_CHUNK_SIZE
from mount_recorder.session import new_session, session_text
from mount_ros.messages.cdr import string_message, wrench
from mount_ros.messages.scalars import OneNumberLayout, ScalarsLayout
from mount_ros.topics import (
    DISPLACEMENT,
    SESSION,
    SIM_CLAMP_FORCE,
    SIM_MOUNT_FORCE,
)
from mount_sim.rack import RackRecording

ForceNoise = Annotated[float, Quantity('N', 'standard deviation of the load cell', 0.0, 20.0)]
DisplacementNoise = Annotated[
    float, Quantity('m', 'standard deviation of the displacement sensor', 0.0, 1e-5)
]

SUBSTEPS = 10
"""Steps of the simulation in each sample of an experiment's rack (chosen): 0.1 ms."""
_TOPICS = (SESSION, DISPLACEMENT, SIM_MOUNT_FORCE, SIM_CLAMP_FORCE)


def record_friction_rack(folder: Path, measured: RackRecording, session: Mapping[str, Any]) -> Path:
    """Write what the friction rack measured at 1 kHz and return the recording.

    The rack has no elastomer, so its `sim/mount_force` is the friction force alone. `session` says what was
    done; times and versions are added.
    """
    writer = BagWriter(folder, chunk_size=LONG_CHUNK_SIZE)
    begin = time.time_ns()
    try:
        for topic in _TOPICS:
            writer.add_topic(f'/{topic.name}', topic.type)
        writer.write(f'/{SESSION.name}', string_message(session_text(new_session(session))), begin)
        positions = ScalarsLayout(DISPLACEMENT)
        forces = OneNumberLayout(wrench)
        rows = zip(measured.displacement, measured.friction_force, measured.normal_force, strict=True)
        for sample, (x, friction, clamp) in enumerate(rows):
            stamp = sample * SAMPLE_TIME_NS
            at = begin + stamp
            writer.write(f'/{DISPLACEMENT.name}', positions.pack(stamp, (x,)), at)
            writer.write(f'/{SIM_MOUNT_FORCE.name}', forces.pack(stamp, friction), at)
            writer.write(f'/{SIM_CLAMP_FORCE.name}', forces.pack(stamp, clamp), at)
    finally:
        writer.close()
    return folder
