"""What the instruments of a simulated rack measured, as a recording in the topics of a drive."""

import math
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from geometry_msgs.msg import WrenchStamped

from mount_bags.bag.writer import BagWriter
from mount_bags.run.session import new_session, session_message, session_text
from mount_models.sampling import SAMPLE_TIME_NS
from mount_ros.messages.scalars import OneNumberLayout, ScalarsLayout
from mount_ros.messages.temperature import temperature_layout
from mount_ros.topics import (
    COIL_RIPPLE,
    COIL_TEMPERATURE,
    DISPLACEMENT,
    SESSION,
    SIM_CLAMP_FORCE,
    SIM_MOUNT_FORCE,
    Delivery,
)
from mount_sim.electronics.electronics import STATUS_EVERY
from mount_sim.rack.friction import RackRecording

FloatArray = npt.NDArray[np.float64]

SUBSTEPS = 10
"""Steps of the simulation in each sample of an experiment's rack (chosen): 0.1 ms."""
_TOPICS = (SESSION, DISPLACEMENT, SIM_MOUNT_FORCE, SIM_CLAMP_FORCE)


def record_friction_rack(folder: Path, measured: RackRecording, session: Mapping[str, Any]) -> Path:
    """Write what the friction rack measured at 1 kHz and return the recording.

    The rack has no elastomer, so its `sim/mount_force` is the friction force alone. `session` says what was
    done; times and versions are added.
    """
    writer = BagWriter(folder)
    begin = time.time_ns()
    try:
        for topic in _TOPICS:
            writer.add_topic(f'/{topic.name}', topic.type, latched=topic.delivery is Delivery.LATCHED)
        writer.write(f'/{SESSION.name}', session_message(session_text(new_session(session))), begin)
        positions = ScalarsLayout(DISPLACEMENT)
        forces = OneNumberLayout(WrenchStamped(), 'wrench.force.z')
        channels = measured.displacement, measured.friction_force, measured.normal_force
        rows = zip(*(channel.tolist() for channel in channels), strict=True)
        for sample, (x, friction, clamp) in enumerate(rows):
            stamp = sample * SAMPLE_TIME_NS
            at = begin + stamp
            writer.write(f'/{DISPLACEMENT.name}', positions.pack(stamp, (x,)), at)
            writer.write(f'/{SIM_MOUNT_FORCE.name}', forces.pack(stamp, friction), at)
            writer.write(f'/{SIM_CLAMP_FORCE.name}', forces.pack(stamp, clamp), at)
    finally:
        writer.close()
    return folder


def record_actuator_rack(
    folder: Path,
    current: FloatArray,
    current_rate: FloatArray,
    flux_rate: FloatArray,
    normal_force: FloatArray,
    celsius: float,
    session: Mapping[str, Any],
) -> Path:
    """Write what the rack measured at one held gap at 1 kHz and return the recording.

    Arrays (n,) in A, A/s, T/s and N; the load cell in the clamp tells the force of the magnet. `celsius` is
    the coil temperature (degC), told ten times a second. `session` says what was done.
    """
    writer = BagWriter(folder)
    begin = time.time_ns()
    try:
        for topic in (SESSION, COIL_RIPPLE, COIL_TEMPERATURE, SIM_CLAMP_FORCE):
            writer.add_topic(f'/{topic.name}', topic.type, latched=topic.delivery is Delivery.LATCHED)
        writer.write(f'/{SESSION.name}', session_message(session_text(new_session(session))), begin)
        ripples, temperatures = ScalarsLayout(COIL_RIPPLE), temperature_layout()
        forces = OneNumberLayout(WrenchStamped(), 'wrench.force.z')
        rows = zip(
            current.tolist(), current_rate.tolist(), flux_rate.tolist(), normal_force.tolist(), strict=True
        )
        for sample, (i, of_current, of_flux, force) in enumerate(rows):
            stamp = sample * SAMPLE_TIME_NS
            at = begin + stamp
            ripple = ripples.pack(stamp, (i, math.nan), (of_current, of_flux))
            writer.write(f'/{COIL_RIPPLE.name}', ripple, at)
            writer.write(f'/{SIM_CLAMP_FORCE.name}', forces.pack(stamp, force), at)
            if sample % STATUS_EVERY == 0:
                writer.write(f'/{COIL_TEMPERATURE.name}', temperatures.pack(stamp, celsius), at)
    finally:
        writer.close()
    return folder
