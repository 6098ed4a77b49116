"""A recording that a report is about, with what is known of its run, and the stretches worth looking at."""

import functools
import math
from dataclasses import dataclass, field

import numpy as np

from engine_mount.recordings.audit import TopicAudit, audit
from engine_mount.recordings.compare import Comparison
from engine_mount.recordings.losses import Losses, losses
from engine_mount.reports.drawing.chart import Array
from engine_mount.reports.sections.charts import Levels
from engine_mount.reports.sections.periodic import Sine, dominant_sine
from engine_mount.reports.sections.sweep import Sweep, find_sweep
from engine_mount.reports.signals import Signal, Signals
from mount_ros.topics import (
    CONTROL_TRACE,
    CURRENT_SETPOINT,
    DISPLACEMENT,
    SIM_CHASSIS_ACCELERATION,
    SIM_MOUNT_FORCE,
    SIM_TRUTH,
)

_STEADY = 4.0  # s, chosen: long enough for 32 periods at 8 Hz
_SETTLING = 0.5  # s, chosen: after damping went on
_SINE_SHARE = 0.98  # chosen: of the variance, above which a stretch counts as one sine


@dataclass(frozen=True)
class Tracking:
    """Wanted and true friction force (N) over time (s), and the rms error over the peak wanted force."""

    time: Array
    wanted: Array
    actual: Array
    error: float


@dataclass(frozen=True)
class WithoutDamping:
    """The undamped mount on the same excitation: displacement (m), acceleration of the chassis (m/s^2).

    Over time (s); the excitation starts at `begin` (s).
    """

    time: Array
    displacement: Array
    chassis_acceleration: Array
    begin: float


@dataclass(frozen=True)
class RunFacts:
    """What the caller knows of a run beside its messages; sentences say where it is from or why it lacks."""

    levels: Levels = field(default_factory=Levels)
    levels_remark: str = ''
    resistance: float = math.nan  # ohm
    resistance_remark: str = 'the resistance of the coil is not known'
    tracking: Tracking | None = None
    tracking_remark: str = 'what the controller wanted is not known'
    undamped: WithoutDamping | None = None
    undamped_remark: str = 'no simulator recorded the excitation'
    without_friction: str = ''  # why figures of friction are not applicable
    colour: str = ''  # of the mount in the seat; empty: that of its place among the recordings


@dataclass(frozen=True)
class Subject:
    """One recording of a report."""

    signals: Signals
    facts: RunFacts = field(default_factory=RunFacts)
    comparison: Comparison | None = None  # of the first recording with this one, where it is asked for

    @functools.cached_property
    def audits(self) -> dict[str, TopicAudit]:
        """The audit of each topic."""
        return audit(self.signals.recording)

    @functools.cached_property
    def losses(self) -> Losses:
        """What was lost, unanswered or wrong."""
        return losses(self.signals.recording, self.audits)

    @property
    def name(self) -> str:
        """What the report calls it."""
        return self.signals.name

    def displacement(self) -> Signal | None:
        """Return the measured displacement (m), else the true one."""
        return self.signals.signal(DISPLACEMENT.name, 'mount') or self.true_displacement()

    def true_displacement(self) -> Signal | None:
        """Return the true displacement (m) where a simulator recorded it."""
        return self.signals.signal(SIM_TRUTH.name, 'displacement')

    def mount_force(self) -> Signal | None:
        """Return the mount force (N): of the load cell, else the true one."""
        measured = self.signals.signal(SIM_MOUNT_FORCE.name, 'wrench.force.z')
        return measured or self.signals.signal(SIM_TRUTH.name, 'mount_force')

    def friction_force(self) -> Signal | None:
        """Return the true friction force (N), None where the mount has none."""
        return None if self.facts.without_friction else self.signals.signal(SIM_TRUTH.name, 'friction_force')

    def acceleration(self) -> Signal | None:
        """Return the acceleration of the chassis (m/s^2): of the sensor, else the true one."""
        measured = self.signals.signal(SIM_CHASSIS_ACCELERATION.name, 'linear_acceleration.z')
        return measured or self.signals.signal(SIM_TRUTH.name, 'chassis_acceleration')

    def setpoint(self) -> Signal | None:
        """Return the current setpoint (A)."""
        return self.signals.signal(CURRENT_SETPOINT.name, 'coil_current')

    def active_from(self) -> float:
        """Return when control began to answer (s), the beginning of the recording if it does not tell."""
        trace = self.signals.signal(CONTROL_TRACE.name, 'damping_active')
        return float(trace.time[0]) if trace is not None else -math.inf

    @functools.cached_property
    def steady(self) -> tuple[tuple[float, float], Sine] | None:
        """Return a stretch (s) in which the displacement is one sine and this sine, None if there is none.

        It is the end of the longest stretch with damping on, or where damping was never on for long, the
        one that moves most.
        """
        moved = self.displacement()
        if moved is None:
            return None
        begin, end = self._steady_candidate(moved)
        inside = (moved.time >= begin) & (moved.time <= end)
        sine = dominant_sine(moved.time[inside], moved.values[inside])
        held = float(np.ptp(moved.time[inside])) if inside.any() else 0.0
        return ((begin, end), sine) if sine.share >= _SINE_SHARE and held * sine.frequency >= 3.0 else None

    def sweep(self) -> Sweep | None:
        """Return the sweep of the excitation: of the road where it is known, else of the displacement."""
        road = self.signals.signal(SIM_TRUTH.name, 'road_height')
        for signal in (road, self.displacement()):
            found = None if signal is None else find_sweep(signal.time, signal.values)
            if found is not None:
                return found
        return None

    def _steady_candidate(self, moved: Signal) -> tuple[float, float]:
        spans = self.signals.damping() or []
        longest = max(spans, key=lambda span: span[1] - span[0], default=(0.0, 0.0))
        if longest[1] - longest[0] >= 2.0 * _SETTLING:
            return max(longest[0] + _SETTLING, longest[1] - _STEADY), longest[1]
        squares = np.nan_to_num(moved.values) ** 2
        spacing = float(np.median(np.diff(moved.time))) if len(moved.time) > 1 else 1.0
        width = min(len(squares), max(1, round(_STEADY / spacing)))
        sums = np.cumsum(np.concatenate([[0.0], squares]))
        first = int(np.argmax(sums[width:] - sums[:-width]))
        return float(moved.time[first]), float(moved.time[first + width - 1])
