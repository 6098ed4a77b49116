"""A recording that a report is about: its signals over seconds, its run, and what it lacks."""

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from engine_mount.recordings.access import Audit, audit
from engine_mount.recordings.answers import peak_current
from engine_mount.recordings.audit import control_spans
from engine_mount.recordings.compare import Comparison
from engine_mount.recordings.events import recorded_marks, switching_times
from engine_mount.recordings.losses import Losses
from engine_mount.recordings.recording import ReadingError, Recording
from engine_mount.recordings.series import SeriesError
from engine_mount.recordings.session import (
    SessionError,
    recorded_sample_rate,
    recorded_session,
    session_content,
    session_parameters,
)
from engine_mount.recordings.times import Times, each_once
from engine_mount.reports.drawing.chart import (
    SPAN_COLOUR,
    Array,
    Curve,
    look_of,
)
from engine_mount.reports.drive.beside import Beside, BesideError, mounts_beside, name_of
from engine_mount.reports.drive.signals import (
    DRIVE_COLUMNS,
    acts_after,
    levels_of,
    load_drive,
    tracking_error,
    wanted_force,
)
from engine_mount.reports.sections.periodic import Sine, dominant_sine
from engine_mount.settings.chosen import Parameters, control_parameters, policy_of, with_recorded_policy
from mount_control.policy import switched_viscous
from mount_models.quantity import with_flattened
from mount_ros.messages.event import Mark
from mount_ros.topics import (
    COIL_RIPPLE,
    CONTROL_TRACE,
    CURRENT_SETPOINT,
    DISPLACEMENT,
    SIM_CHASSIS_ACCELERATION,
    SIM_MOUNT_FORCE,
    SIM_TRUTH,
)
from mount_sim.plant.mounts import seat_of, without_friction
from mount_sim.plant.ripple import RippleCoil

_TRUTH = SIM_TRUTH.name
QUANTITIES = {
    'displacement': ((DISPLACEMENT.name, 'mount'), (_TRUTH, 'displacement')),
    'true displacement': ((_TRUTH, 'displacement'), (DISPLACEMENT.name, 'mount')),
    'mount force': ((SIM_MOUNT_FORCE.name, 'wrench.force.z'), (_TRUTH, 'mount_force')),
    'friction force': ((_TRUTH, 'friction_force'),),
    'acceleration': (
        (SIM_CHASSIS_ACCELERATION.name, 'linear_acceleration.z'),
        (_TRUTH, 'chassis_acceleration'),
    ),
    'setpoint': ((CURRENT_SETPOINT.name, 'coil_current'),),
    'true current': ((_TRUTH, 'coil_current'),),
    'measured current': ((COIL_RIPPLE.name, 'coil_current'),),
    'damping': ((CONTROL_TRACE.name, 'damping_active'),),
}
"""Topic and column of what a report shows, in SI units; of several the first that was recorded."""
_NEEDED: dict[str, set[str]] = {topic: set(columns) for topic, columns in DRIVE_COLUMNS.items()}
"""{topic: columns}, read in one pass."""
for _places in QUANTITIES.values():
    for _topic, _column in _places:
        _NEEDED.setdefault(_topic, set()).add(_column)
_STEADY = 4.0  # s, chosen: long enough for 32 periods at 8 Hz
_SETTLING = 0.5  # s, chosen: after damping went on
_SINE_SHARE = 0.98  # chosen: of the variance, above which a stretch counts as one sine


class Signal(NamedTuple):
    """One signal: times in s on the time axis of the report, rising, and values in SI units."""

    time: Array
    values: Array

    def peak(self, begin: float = -math.inf, end: float = math.inf) -> tuple[float, float]:
        """Return the highest absolute value between two times (s) and when it is, NaN where none is known."""
        inside = np.flatnonzero((self.time >= begin) & (self.time <= end) & np.isfinite(self.values))
        if not len(inside):
            return math.nan, math.nan
        place = inside[np.argmax(np.abs(self.values[inside]))]
        return abs(float(self.values[place])), float(self.time[place])


@dataclass(frozen=True)
class Run:
    """What the session says of a run; `unknown` is why it says nothing, then all has its default."""

    unknown: str = ''
    parameters: Parameters = field(default_factory=dict)
    levels: dict[str, float] = field(default_factory=dict)  # m, by their labels
    current_limit: float | None = None  # A
    resistance: float = RippleCoil().resistance  # ohm
    mount: str = ''  # in the seat
    without_friction: str = ''  # why figures of friction are not applicable


class Tracking(NamedTuple):
    """Wanted and true friction force (N) over time (s), the rms error over the peak wanted force."""

    time: Array
    wanted: Array
    actual: Array
    error: float
    remark: str  # which force it is


class Subject:
    """One recording of a report. What is looked for and not there is noted in `missing`, in words."""

    def __init__(
        self,
        recording: Recording,
        name: str = '',
        *,
        several: bool = False,
        zero: int | None = None,
    ):
        """Take the name of a recording, whether there are `several`, and the stamp (ns) of time 0."""
        self.recording = recording
        self.name = name or recording.short_name
        self.prefix = f'{self.name}: ' if several else ''
        self.missing: list[str] = []
        self.comparison: Comparison | None = None  # of the first recording with this one
        self._several = several
        self._signals: dict[tuple[str, str], Signal | None] = {}
        recording.load_columns({topic: names for topic, names in _NEEDED.items() if topic in recording})
        self.zero = recording.time_axis.zero if zero is None else zero

    def __getitem__(self, quantity: str) -> Signal | None:
        """Return one of `QUANTITIES`, None (and a note in `missing`) where it cannot be had."""
        found = (self.signal(topic, column) for topic, column in QUANTITIES[quantity])
        return next(filter(None, found), None)

    def signal(self, topic: str, column: str) -> Signal | None:
        """Return a column of a topic, None (and a note in `missing`) where it cannot be had."""
        key = (topic, column)
        if key not in self._signals:
            self._signals[key] = self._read(topic, column)
        return self._signals[key]

    def seconds(self, stamps: Times) -> Array:
        """Return stamps (ns) as times of the report."""
        return (stamps - self.zero) / 1e9

    def curve(self, what: str, x: Array, y: Array) -> Curve:
        """Return a curve in the look of this recording, with its name where there are several."""
        label = f'{what}, {self.name}' if self._several else what
        return Curve(label, x, y, *self.look)

    @functools.cached_property
    def look(self) -> tuple[str, str]:
        """Colour and dash of its curves."""
        return look_of(self.mount)

    @property
    def mount(self) -> str:
        """The name of its own mount among those beside it."""
        return name_of(self.run.mount)

    @functools.cached_property
    def shade(self) -> Curve | None:
        """The degree of damping, None where it does not apply or was never above 0."""
        degree = self['damping']
        if self.run.without_friction or degree is None or not self.damping:
            return None
        return Curve('degree of damping', degree.time, degree.values, SPAN_COLOUR)

    @functools.cached_property
    def session(self) -> str:
        """The text of its session message, empty where it has none."""
        try:
            return recorded_session(self.recording)
        except (ReadingError, SeriesError):
            return ''

    @functools.cached_property
    def sample_rate(self) -> float:
        """Hz, as its session tells."""
        return recorded_sample_rate(self.recording)

    @functools.cached_property
    def run(self) -> Run:
        """What its session says of the run."""
        try:
            parameters = session_parameters(session_content(self.session))
        except SessionError:
            parameters = {}
        if not parameters:
            return Run('the recording has no session message that tells the parameters')
        try:
            parameters = with_recorded_policy(parameters)
            mount = seat_of(parameters)
            reason = without_friction(mount)
            return Run(
                parameters=parameters,
                levels={} if reason else levels_of(*policy_of(parameters)),
                current_limit=control_parameters(parameters).highest_current,
                resistance=with_flattened(RippleCoil(), parameters.get('mount_sim', {}), 'coil').resistance,
                mount=mount,
                without_friction=reason,
            )
        except (ValueError, TypeError, AttributeError) as error:
            return Run(f'the parameters of the session cannot be used: {error}')

    @functools.cached_property
    def audit(self) -> Audit:
        """What was lost, unanswered or wrong: of each topic, and in all."""
        return audit(self.recording)

    @functools.cached_property
    def losses(self) -> Losses:
        """What was lost, unanswered or wrong in all."""
        return self.audit.losses

    @functools.cached_property
    def damping(self) -> list[tuple[float, float]] | None:
        """The stretches (s) in which damping was on, None where the recording does not tell."""
        active = self['damping']
        if active is None:
            return None
        on, off = switching_times(active.time, active.values)
        ends = np.append(off, active.time[-1])
        return [(float(begin), float(ends[np.searchsorted(ends, begin)])) for begin in on]

    @property
    def active_from(self) -> float:
        """When control began to answer (s), -inf where the recording does not tell."""
        trace = self['damping']
        return float(trace.time[0]) if trace is not None else -math.inf

    @property
    def marks(self) -> list[tuple[float, Mark]]:
        """Its marks with their times (s), none where there is no readable topic of them."""
        axis = self.recording.time_axis
        shift = (axis.zero - self.zero) / 1e9
        try:
            return [
                (axis.of_mark(mark.time, time) + shift, mark)
                for marks in recorded_marks(self.recording).values()
                for time, mark in marks
            ]
        except (ReadingError, SeriesError):
            return []

    @functools.cached_property
    def beside(self) -> Beside | str:
        """What other mounts do on its road, or why that is not known."""
        if self.run.unknown:
            return self.run.unknown
        try:
            return mounts_beside(self.recording, self.run.parameters)
        except BesideError as reason:
            return str(reason)

    @functools.cached_property
    def tracking(self) -> Tracking | str:
        """How friction followed what the controller wanted, or why that is not known."""
        if self.run.unknown or self.run.without_friction:
            return self.run.unknown or f'not applicable: {self.run.without_friction}'
        needed = ((DISPLACEMENT.name, 'mount'), *QUANTITIES['damping'], *QUANTITIES['friction force'])
        lacking = [topic for topic, column in needed if self.signal(topic, column) is None]
        if lacking:
            return f'what was not recorded is needed: {", ".join(lacking)}'
        policy, own = policy_of(self.run.parameters)
        try:
            drive = load_drive(self.recording)
            wanted, _ = wanted_force(drive, policy, own)
            error = tracking_error(drive, policy, own)
        except (ValueError, KeyError) as reason:
            return f'it cannot be computed: {reason}'
        later = f'{1e3 * acts_after(drive.sample_time):g} ms later'
        remark = f'wanted is the force that the policy asked for, {later}, when it acts'
        if policy is switched_viscous:
            velocity = 'at the true velocity in the band, without delay'
            remark = f'wanted is the force of damper {own.damper} {velocity}'
        # What the controller wants while damping is off is no force.
        active = np.interp(drive.truth.time, drive.seen.time, drive.seen.damping_active.astype(float)) > 0.5
        time = drive.truth.time + (drive.zero - self.zero) / 1e9
        return Tracking(time, np.where(active, wanted, 0.0), drive.truth.friction_force, error, remark)

    @functools.cached_property
    def figures(self) -> dict[str, Any]:
        """Its figures in SI units; None: unknown or not applicable."""
        moved, spans = self['displacement'], self.damping
        numbers = {
            'duration_s': math.nan if moved is None else float(np.ptp(moved.time)),
            'peak_displacement_m': math.nan if moved is None else moved.peak()[0],
            'peak_current_a': peak_current(self.recording, control_spans(self.audit.topics)),
            'tracking_error_rms': self.tracking.error if isinstance(self.tracking, Tracking) else math.nan,
        }
        figures = {name: None if math.isnan(value) else value for name, value in numbers.items()}
        figures['damping_switched_on'] = None if spans is None else len(spans)
        if self.run.without_friction:
            figures |= dict.fromkeys(('peak_current_a', 'damping_switched_on'))
        return {**figures, **self.losses.as_json()}

    @functools.cached_property
    def steady(self) -> tuple[tuple[float, float], Sine] | None:
        """A stretch (s) in which the displacement is one sine and this sine, None if there is none.

        It is the end of the longest stretch with damping on, or where damping was never on for long, the
        one that moves most.
        """
        moved = self['displacement']
        if moved is None:
            return None
        begin, end = self._steady_candidate(moved)
        inside = (moved.time >= begin) & (moved.time <= end)
        sine = dominant_sine(moved.time[inside], moved.values[inside])
        held = np.ptp(moved.time[inside]) if inside.any() else 0.0
        return ((begin, end), sine) if sine.share >= _SINE_SHARE and held * sine.frequency >= 3.0 else None

    def _steady_candidate(self, moved: Signal) -> tuple[float, float]:
        longest = max(self.damping or [], key=lambda span: span[1] - span[0], default=(0.0, 0.0))
        if longest[1] - longest[0] >= 2.0 * _SETTLING:
            return max(longest[0] + _SETTLING, longest[1] - _STEADY), longest[1]
        squares = np.nan_to_num(moved.values) ** 2
        spacing = np.median(np.diff(moved.time)) if len(moved.time) > 1 else 1.0
        width = min(len(squares), max(1, round(_STEADY / spacing)))
        sums = np.cumsum(np.concatenate([[0.0], squares]))
        first = np.argmax(sums[width:] - sums[:-width])
        return float(moved.time[first]), float(moved.time[first + width - 1])

    def _read(self, topic: str, column: str) -> Signal | None:
        try:
            series = self.recording[topic]
            if len(series):
                stamps, places = each_once(series.stamps)
                return Signal(self.seconds(stamps), np.asarray(series[column], np.float64)[places])
            lack = f'{topic} has no message'
        except SeriesError as error:
            lack = f'not as this project records it: {error}'
        except ReadingError:
            lack = f'there is no topic {topic}'
        if lack not in self.missing:
            self.missing.append(lack)
        return None


def share_road(subjects: Sequence[Subject]) -> bool:
    """Return whether all are on one road, as far as each was recorded; one is on its own."""
    roads = [each.beside.road for each in subjects if not isinstance(each.beside, str)]
    count = min(map(len, roads), default=0)
    same = len(roads) == len(subjects) and all(
        np.array_equal(each[:count], roads[0][:count]) for each in roads
    )
    return same or len(subjects) == 1


def other_mounts(subjects: Sequence[Subject], quantity: str) -> dict[str, Signal]:
    """Return {name: signal} of the computed mounts on the road of all recordings that none of these has."""
    beside, column = subjects[0].beside, dict(QUANTITIES[quantity]).get(_TRUTH)
    if isinstance(beside, str) or column is None or not share_road(subjects):
        return {}
    time, recorded = subjects[0].seconds(beside.stamps), {each.mount for each in subjects}
    others = beside.truths.items()
    return {name: Signal(time, truth[column]) for name, truth in others if name not in recorded}


def shared_sentences(subjects: Sequence[Subject], remarks: Sequence[tuple[Subject, str]]) -> list[str]:
    """Return what is said of each subject; what is true of all of them once, without a name.

    A remark begins small and has no full stop.
    """
    names: dict[str, list[str]] = {}
    for subject, text in remarks:
        names.setdefault(text, []).append(subject.name)
    return [
        f'{text[:1].upper()}{text[1:]}.' if len(of) == len(subjects) else f'{", ".join(of)}: {text}.'
        for text, of in names.items()
    ]
