"""Wear and other drift over many recordings: contact gap and offset current by straight lines.

Noise model: each value has the standard deviation that came with it, independent of the others. Where the
values scatter more about the line than that explains, all are taken as that much less sure (Birge ratio);
where they scatter less, the stated ones stand. Without any stated deviation the scatter alone counts.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from engine_mount.identification.fitting import FloatArray, IdentificationError
from engine_mount.recordings.place import open_run
from engine_mount.recordings.screen import Screen
from engine_mount.recordings.session import recorded_session, session_content
from mount_models.specimen import Specimen
from mount_ros.topics import AIR_GAP, CURRENT_FORCE_TABLE

FEWEST = 2


@dataclass(frozen=True)
class Line:
    """value = `level` + `slope` (t - `centre`): centre in h, level in the values' unit, slope per h.

    `*_std` are standard deviations; NaN where two values without stated deviations leave none.
    `ratio` is how many times more the values scatter than stated: 1 or more, NaN for two of them.
    """

    centre: float
    level: float
    slope: float
    level_std: float
    slope_std: float
    ratio: float

    def at(self, hours: npt.ArrayLike) -> FloatArray:
        """Return the line at times in h."""
        return np.asarray(self.level + self.slope * (np.asarray(hours, float) - self.centre))

    def std_at(self, hours: npt.ArrayLike) -> FloatArray:
        """Return the standard deviation of the line at times in h."""
        return np.hypot(self.level_std, self.slope_std * (np.asarray(hours, float) - self.centre))


@dataclass(frozen=True)
class State:
    """One recording: at `hours` gap and its deviation (m), offset current (A).

    `pressed` (m) is by how much the highest clamping force compresses the pads.
    """

    recording: str
    hours: float
    contact_gap: float
    contact_gap_std: float
    offset_current: float
    pressed: float


@dataclass(frozen=True)
class DriftResult:
    """All states by time, the lines through their values by name, and the travel until the law's range ends.

    `limit` is the contact gap (m) at which the pressed gap leaves the range of the law, `left` (m) how far
    it is, `hours_left` when at this wear; None where no wear is seen.
    """

    states: list[State]
    lines: dict[str, Line]
    limit: float
    left: float
    left_std: float
    hours_left: float | None

    def figures(self) -> dict[str, Any]:
        """Return the result as plain numbers, for JSON."""
        names = {'contact_gap': 'm', 'contact_gap_std': 'm', 'offset_current': 'a'}
        result: dict[str, Any] = {
            'recordings': [
                {'recording': state.recording, 'hours': state.hours}
                | {f'{name}_{unit}': getattr(state, name) for name, unit in names.items()}
                for state in self.states
            ]
        }
        for name, unit in (('contact_gap', 'm'), ('offset_current', 'a')):
            line = self.lines[name]
            result[name] = {
                f'per_hour_{unit}': line.slope,
                f'per_hour_std_{unit}': _known(line.slope_std),
                f'mean_{unit}': line.level,
                'scatter_over_stated': _known(line.ratio),
            }
        return {
            **result,
            'least_contact_gap_m': self.limit,
            'remaining_travel_m': self.left,
            'remaining_travel_std_m': self.left_std,
            'remaining_hours': self.hours_left,
        }

    def report(self, screen: Screen) -> None:
        """Show wear and drift per hour, and the travel left."""
        units = {'contact_gap': (1e6, 'um/h'), 'offset_current': (1e3, 'mA/h')}
        for name, line in self.lines.items():
            factor, unit = units[name]
            std = 'unknown' if math.isnan(line.slope_std) else f'{factor * line.slope_std:.2g}'
            screen.say(
                f'{name.replace("_", " ")}: {factor * line.slope:+.3g} +- {std} {unit} (one deviation)'
            )
        end = 'no wear beyond two deviations is seen'
        if self.hours_left is not None:
            end = f'at this wear in {self.hours_left:.3g} h'
        screen.say(
            f'{1e6 * self.left:.1f} +- {1e6 * self.left_std:.2g} um left until the contact gap reaches '
            f'{1e6 * self.limit:.1f} um, where the pressed gap leaves the range of the law; {end}'
        )

    def draw(self, file: Path) -> None:
        """Write the picture of all lines to `file` (PNG)."""
        from engine_mount.identification.pictures import draw_drift

        draw_drift(self, file)


def identify_drift(
    recordings: Sequence[Path], specimen: Specimen, hours: Mapping[Path, float] | None = None
) -> DriftResult:
    """Return wear and drift; see `engine_mount.identification.identify.drift`."""
    hours = hours or {}
    missing = [path for path in recordings if path not in hours]
    if hours and missing:
        raise IdentificationError(f'--hours must be given for all recordings or none; {missing[0]} has none')
    begin = min((_session_start(path) for path in missing), default=0.0)
    states = [
        _state(path, specimen, hours[path] if hours else _session_start(path) - begin) for path in recordings
    ]
    states.sort(key=lambda state: state.hours)
    times = [state.hours for state in states]
    gap = fit_line(
        times, [state.contact_gap for state in states], [state.contact_gap_std for state in states]
    )
    lines = {
        'contact_gap': gap,
        'offset_current': fit_line(times, [state.offset_current for state in states]),
    }
    limit = specimen.force_law.gap_low + states[-1].pressed
    left = float(gap.at(times[-1])) - limit
    wears = gap.slope < -2.0 * gap.slope_std
    hours_left = max(left, 0.0) / -gap.slope if wears else None
    return DriftResult(states, lines, limit, left, float(gap.std_at(times[-1])), hours_left)


def fit_line(hours: npt.ArrayLike, values: npt.ArrayLike, stds: npt.ArrayLike | None = None) -> Line:
    """Return the weighted line through `values` (n,); raises `IdentificationError` where there is none."""
    t, y = np.asarray(hours, float), np.asarray(values, float)
    stated = np.ones(t.size) if stds is None else np.asarray(stds, float)
    if t.size < FEWEST:
        raise IdentificationError(
            f'{t.size} recording shows no drift; at least {FEWEST} from different times are needed'
        )
    if not np.isfinite([t, y, stated]).all():
        raise IdentificationError('a time or value is no number; leave that recording out')
    if np.ptp(t) <= 0.0:
        raise IdentificationError(f'all {t.size} recordings are from one time; add some from before or after')
    if not (stated > 0.0).all():
        raise IdentificationError(
            'each standard deviation must be above 0; leave out the recording without one'
        )
    weights = 1.0 / stated**2
    centre, level = ((weights * each).sum() / weights.sum() for each in (t, y))
    spread = (weights * (t - centre) ** 2).sum()
    slope = (weights * (t - centre) * y).sum() / spread
    scatter = math.nan
    if t.size > FEWEST:
        scatter = math.sqrt((weights * (y - level - slope * (t - centre)) ** 2).sum() / (t.size - FEWEST))
    factor, ratio = scatter, math.nan
    if stds is not None:
        factor = max(1.0, scatter)  # 1 where the scatter is NaN
        ratio = factor if t.size > FEWEST else math.nan
    deviations = factor / math.sqrt(weights.sum()), factor / math.sqrt(spread)
    return Line(float(centre), float(level), float(slope), *deviations, ratio)


def _state(path: Path, specimen: Specimen, hours: float) -> State:
    recording = open_run(path)
    for topic in (AIR_GAP, CURRENT_FORCE_TABLE):
        if topic.name not in recording or not len(recording[topic.name]):
            raise IdentificationError(
                f'{path} holds no {topic.name}; give recordings of whole drives, in which the initialisation '
                'ended well'
            )
    gaps = recording[AIR_GAP.name]
    numbers = {name: float(gaps[name][-1]) for name in ('contact_gap', 'contact_gap_std', 'offset_current')}
    for name, value in numbers.items():
        if not 0.0 < value < math.inf:
            raise IdentificationError(
                f'{path}: {name} ({value:g}) must be a number above 0; leave this recording out'
            )
    highest = float(max(recording[CURRENT_FORCE_TABLE.name].message(-1).data))
    pressed = highest / specimen.pad_stiffness
    return State(path.name, hours, **numbers, pressed=pressed)


def _session_start(path: Path) -> float:
    """Return when the session began, in hours of the clock."""
    try:
        started = session_content(recorded_session(open_run(path)))['started']
        return datetime.fromisoformat(started).timestamp() / 3600.0
    except (KeyError, TypeError, ValueError) as error:
        raise IdentificationError(
            f'{path} holds no time at which it began ({error}); give the hours of all by --hours FILE=H'
        ) from None


def _known(value: float) -> float | None:
    return value if math.isfinite(value) else None
