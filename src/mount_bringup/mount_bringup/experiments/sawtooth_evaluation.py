"""Step two and three of the identification, from a recording: deflection u, mu over u, a and b of each "
"stroke."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.signal import lfilter

from mount_bags.reading import Recording
from mount_models.friction.contact import FrictionContact
from mount_models.friction.simplified import FADE_VELOCITY

FloatArray = npt.NDArray[np.float64]

MICROSLIP_WAY = 0.2e-3
"""Way behind a turning point in m (chosen) within which the pads still stick in part: 84 um at 8 Hz."""

FADED_BELOW = 2.5 * FADE_VELOCITY
"""Speed in m/s below which the simplified model fades friction out by more than 0.2 % (derived)."""


@dataclass(frozen=True)
class RackRecording:
    """What a recording of the friction rack holds, all (n,) in SI units; time from the first sample."""

    time: FloatArray
    displacement: FloatArray
    friction_force: FloatArray
    normal_force: FloatArray

    @property
    def sample_time(self) -> float:
        """Seconds between two samples."""
        return float((self.time[-1] - self.time[0]) / (self.time.size - 1))

    @property
    def velocity(self) -> FloatArray:
        """Velocity (m/s): the displacement's difference to the sample before."""
        return np.diff(self.displacement, prepend=self.displacement[0]) / self.sample_time


@dataclass(frozen=True)
class Stroke:
    """One stroke at constant speed; `samples` lie behind the microslip, where the pads slide.

    `offset` and `slope` (1/m) are a and b of Eq (12), fitted to mu over u of these samples; `residual` is the
    rms of what the line leaves of mu, `jump` by how much mu falls from there to the end.
    """

    whole: slice
    samples: slice
    velocity: float
    normal_force: float
    offset: float
    slope: float
    residual: float
    jump: float


def read_rack(recording: Recording) -> RackRecording:
    """Return the measurements of a recording of the friction rack."""
    displacement, friction = recording['displacement'], recording['sim/mount_force']
    return RackRecording(
        time=(displacement.stamps - displacement.stamps[0]) * 1e-9,
        displacement=displacement['mount'],
        friction_force=friction['wrench.force.z'],
        normal_force=recording['sim/clamp_force']['wrench.force.z'],
    )


def deflection(rack: RackRecording, contact: FrictionContact) -> FloatArray:
    """Return xi (m): the measured force drives the linear part, d_R xi' = F - c_R xi (trapezoidal rule)."""
    half = 0.5 * rack.sample_time
    creep = half * contact.tangential_stiffness / contact.tangential_damping
    gain = half / contact.tangential_damping
    return np.asarray(lfilter([gain, gain], [1.0 + creep, creep - 1.0], rack.friction_force))


def strokes(rack: RackRecording, contact: FrictionContact) -> list[Stroke]:
    """Return all strokes but the first, which no turning point precedes."""
    xi = deflection(rack, contact)
    moving = np.sign(rack.velocity[1:])
    turns = 1 + np.flatnonzero(np.diff(moving))
    ends = np.append(turns[1:], rack.time.size - 1)
    return [_stroke(rack, xi, int(first), int(last)) for first, last in zip(turns, ends, strict=True)]


def slip_regions(
    rack: RackRecording, found: list[Stroke]
) -> tuple[npt.NDArray[np.bool_], npt.NDArray[np.bool_], npt.NDArray[np.bool_]]:
    """Return which samples are microslip, which macroslip, and which are too slow for the simplified model.

    The simplified model fades friction out at low speed; below `FADED_BELOW` by more than 0.2 %.
    """
    micro, macro, faded = (np.zeros(rack.time.size, bool) for _ in range(3))
    for stroke in found:
        micro[stroke.whole] = True
        micro[stroke.samples] = False
        (macro if abs(stroke.velocity) > FADED_BELOW else faded)[stroke.samples] = True
    return micro, macro, faded


def _stroke(rack: RackRecording, xi: FloatArray, first: int, last: int) -> Stroke:
    """Return the stroke between the turning points at the samples `first` and `last`."""
    velocity = float(np.median(rack.velocity[first + 1 : last]))
    samples = slice(first + 1 + round(MICROSLIP_WAY / abs(velocity) / rack.sample_time), last)
    coefficient = np.abs(rack.friction_force[samples]) / rack.normal_force[samples]
    u = np.sign(rack.friction_force[samples]) * xi[samples]
    slope, offset = np.polyfit(u, coefficient, 1)
    line = offset + slope * u
    return Stroke(
        whole=slice(first, last),
        samples=samples,
        velocity=velocity,
        normal_force=float(np.median(rack.normal_force[samples])),
        offset=float(offset),
        slope=float(slope),
        residual=float(np.sqrt(np.mean((coefficient - line) ** 2))),
        jump=float(line[0] - line[-1]),
    )
