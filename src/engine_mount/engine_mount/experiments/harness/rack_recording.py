"""Recordings of the rack in experiments: currents at fixed gaps, motion and force of a contact."""

import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import numpy.typing as npt

from engine_mount.reports.drive.signals import FloatArray
from mount_models.coil.gap import measured_inductance
from mount_models.quantity import Quantity
from mount_models.sampling import HIGHEST_CURRENT, SAMPLE_TIME_NS
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
from mount_sim.plant.reluctance import ReluctanceActuator
from mount_sim.plant.reluctance import force as magnetic_force
from mount_sim.plant.ripple import RippleCoil, current_rate, flux_rate
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


RIG_GAPS = np.linspace(250e-6, 550e-6, 31)
"""Gaps held on the rig, m (chosen): contact gaps of new and worn pads up to the gap at rest."""

RIG_CURRENTS = np.linspace(0.0, HIGHEST_CURRENT, 151)
"""Currents stepped through at each gap, A (chosen)."""


@dataclass(frozen=True)
class RigMeasurements:
    """Gaps (m, shape (G,)), currents (A, (I,)), force (N, (G, I)) and incremental inductance (H, (G, I))."""

    gaps: FloatArray
    currents: FloatArray
    force: FloatArray
    inductance: FloatArray


def measure_actuator(
    actuator: ReluctanceActuator,
    coil: RippleCoil,
    gaps: npt.ArrayLike = RIG_GAPS,
    currents: npt.ArrayLike = RIG_CURRENTS,
    *,
    force_noise: float = 0.0,
    ratio_noise: float = 0.0,
    seed: int = 0,
) -> RigMeasurements:
    """Return force and ripple inductance at every pair of `gaps` (m) and `currents` (A), the gap held.

    The noises are standard deviations: of the force (N), of the ratio of flux rate to current rate (1).
    """
    gaps, currents = np.asarray(gaps, float), np.asarray(currents, float)
    turns_area = actuator.turns * actuator.gap_area
    force, inductance = np.empty((2, gaps.size, currents.size))
    for place in np.ndindex(force.shape):
        gap, current = gaps[place[0]], currents[place[1]]
        force[place] = magnetic_force(actuator, current, gap)
        inductance[place] = measured_inductance(
            turns_area, flux_rate(coil, actuator, current), current_rate(coil, actuator, current, gap)
        )
    random = np.random.default_rng(seed)
    force += force_noise * random.standard_normal(force.shape)
    inductance *= 1.0 + ratio_noise * random.standard_normal(force.shape)
    return RigMeasurements(gaps, currents, force, inductance)
