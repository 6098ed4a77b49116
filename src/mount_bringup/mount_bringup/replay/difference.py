"""How the answers of a replay differ from the recorded ones: to the bit first, then in words."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from mount_bags.switching_changes import SwitchingChange, paired_switchings, switching_times
from mount_bringup.replay.core import ControlAnswers, RampAnswers, Replayed
from mount_bringup.replay.input import Column, ReplayInput, Times
from mount_models.sampling import SAMPLE_TIME

# Where a recording begins in the middle of control: what the controller remembered is not in it. The
# band-pass forgets by e^-25 in 1 s, the friction deflection slowly; measured after 3 s: within 0.06 uA.
SETTLING = 3.0  # s, chosen
SETTLED = 1e-6  # A, chosen
_MICROAMPERE = 1e6


@dataclass(frozen=True)
class Moment:
    """One setpoint in both: time in s on the recording's time axis, currents in A."""

    time: float
    recorded: float
    replayed: float


@dataclass
class Switching:
    """When damping went on and off, s on the recording's time axis."""

    on: list[float] = field(default_factory=list)
    off: list[float] = field(default_factory=list)


@dataclass
class Difference:
    """Recorded answers against replayed ones; `differing` setpoints are not equal to the bit."""

    compared: int
    differing: int
    unanswered: int  # recorded setpoints of the samples replayed for which the replay has none
    first: Moment | None
    largest: Moment | None
    traces_compared: int
    traces_differing: dict[str, int]  # steps that differ, by intermediate
    settling_skipped: int  # setpoints not compared, because the recording begins in the middle of control

    @property
    def equal(self) -> bool:
        """Whether every compared setpoint and every intermediate is the same to the bit."""
        return bool(self.compared) and not (self.differing or self.unanswered or self.traces_differing)

    @property
    def agrees(self) -> bool:
        """Whether the answers are equal, or as near as a recording that begins in the middle allows."""
        if not self.settling_skipped or self.unanswered:
            return self.equal
        return self.largest is None or abs(self.largest.replayed - self.largest.recorded) <= SETTLED


def difference(given: ReplayInput, replayed: Replayed) -> Difference | None:
    """Compare the replay with the recorded answers; None where there are none of its samples."""
    answers = given.answers
    if answers is None:
        return None
    stamps, currents, compared = _setpoints(given, replayed)
    places = np.clip(np.searchsorted(answers.stamps, stamps), 0, len(answers.stamps) - 1)
    found = answers.stamps[places] == stamps
    recorded = answers.currents[places]
    judged = found & compared
    if not judged.any():
        return None
    differs = judged & ~_same_bits(recorded, currents)
    first = largest = None
    if differs.any():
        size = np.where(differs, np.abs(recorded - currents), -1.0)
        first, largest = (
            Moment(float(stamps[place] - given.zero) / 1e9, float(recorded[place]), float(currents[place]))
            for place in (int(np.argmax(differs)), int(np.nanargmax(size)))
        )
    traces_compared, traces_differing = _traces(given, replayed)
    return Difference(
        compared=int(np.count_nonzero(judged)),
        differing=int(np.count_nonzero(differs)),
        unanswered=_unanswered(given, stamps),
        first=first,
        largest=largest,
        traces_compared=traces_compared,
        traces_differing=traces_differing,
        settling_skipped=int(np.count_nonzero(found & ~compared)),
    )


def replayed_switching(given: ReplayInput, replayed: Replayed) -> Switching:
    """Return when the replay switched damping."""
    return _switching(
        given,
        [(run.stamps[run.traced], run.traces['damping_active'][run.traced]) for run in replayed.runs],
    )


def recorded_switching(given: ReplayInput) -> Switching | None:
    """Return when damping was switched in the recording; None where it holds no traces."""
    answers = given.answers
    if answers is None or not answers.trace_stamps.size or 'damping_active' not in answers.traces:
        return None
    active = answers.traces['damping_active']
    runs = []
    for run in given.controls:
        inside = (answers.trace_stamps >= run.stamps[0]) & (answers.trace_stamps <= run.stamps[-1])
        runs.append((answers.trace_stamps[inside], active[inside]))
    return _switching(given, runs)


def switching_changes(recorded: Switching, replayed: Switching) -> list[SwitchingChange]:
    """Return the switchings that appeared, vanished or moved."""
    pairs = paired_switchings(
        (np.array(recorded.on), np.array(recorded.off)),
        (np.array(replayed.on), np.array(replayed.off)),
        SAMPLE_TIME,
    )
    return [change for change in pairs if change.alone or change.moved]


def difference_in_words(found: Difference) -> list[str]:
    """Return the sentences that tell a difference, the most important first."""
    if found.equal:
        return [
            f'equal to the recorded setpoints to the last bit ({found.compared} setpoints, '
            f'{found.traces_compared} steps with all their intermediates)'
        ]
    sentences = []
    if found.first is not None and found.largest is not None:
        sentences += [
            f'{found.differing} of {found.compared} setpoints differ',
            f'first at {_in_words(found.first)}',
            f'largest at {_in_words(found.largest)}',
        ]
    if found.unanswered:
        sentences.append(f'{found.unanswered} recorded setpoints have no answer in the replay')
    if found.traces_differing:
        shown = ', '.join(f'{name} ({count})' for name, count in found.traces_differing.items())
        sentences.append(f'intermediates that differ (steps of {found.traces_compared}): {shown}')
    return sentences


def change_in_words(change: SwitchingChange) -> str:
    """Return the sentence for one switching that is not where it was."""
    what = f'damping {"on" if change.on else "off"}'
    if change.time_a is None:
        return f'{what} at {change.time_b:.3f} s appeared'
    if change.time_b is None:
        return f'{what} at {change.time_a:.3f} s vanished'
    way = 'later' if change.moved > 0 else 'earlier'
    distance = f'{abs(change.moved) * 1e3:.0f} ms {way}'
    return f'{what} at {change.time_a:.3f} s moved to {change.time_b:.3f} s, {distance}'


def _in_words(moment: Moment) -> str:
    distance = _MICROAMPERE * abs(moment.replayed - moment.recorded)
    size = f'{distance * 1e-3:.3f} mA' if distance >= 1.0 else f'{distance:.3g} uA'
    values = f'recorded {moment.recorded:.6f} A, replayed {moment.replayed:.6f} A'
    return f'{moment.time:.3f} s: {values} ({size} apart)'


def _setpoints(given: ReplayInput, replayed: Replayed) -> tuple[Times, Column, NDArray[np.bool_]]:
    """Return stamps and setpoints of the replay, and which of them can be compared."""
    stamps, currents, compared = [], [], []
    for part, answers in zip(given.parts, replayed.parts, strict=True):
        values = answers.setpoints
        stamps.append(answers.stamps)
        currents.append(values)
        compared.append(_settled(part, answers))
    return np.concatenate(stamps), np.concatenate(currents), np.concatenate(compared)


def _settled(part: object, answers: RampAnswers | ControlAnswers) -> NDArray[np.bool_]:
    if getattr(part, 'from_its_beginning', True):
        return np.ones(len(answers.stamps), bool)
    return answers.stamps - answers.stamps[0] >= round(SETTLING * 1e9)


def _unanswered(given: ReplayInput, stamps: Times) -> int:
    """Return how many recorded setpoints in the spans of the parts have no counterpart."""
    assert given.answers is not None
    spans = [(part.stamps[0], part.stamps[-1]) for part in given.parts]
    known = given.answers.stamps
    inside = np.zeros(len(known), bool)
    for begin, end in spans:
        inside |= (known >= begin) & (known <= end)
    samples = np.concatenate([part.stamps for part in given.parts])
    return int(np.setdiff1d(np.intersect1d(known[inside], samples), stamps).size)


def _traces(given: ReplayInput, replayed: Replayed) -> tuple[int, dict[str, int]]:
    """Return how many traced steps were compared and how many differ, by intermediate."""
    assert given.answers is not None
    recorded, total, differing = given.answers, 0, dict.fromkeys(given.answers.traces, 0)
    for part, answers in zip(given.controls, replayed.runs, strict=True):
        usable = answers.traced & _settled(part, answers)
        places = np.clip(
            np.searchsorted(recorded.trace_stamps, answers.stamps), 0, max(0, len(recorded.trace_stamps) - 1)
        )
        if not len(recorded.trace_stamps):
            continue
        usable &= recorded.trace_stamps[places] == answers.stamps
        total += int(np.count_nonzero(usable))
        for name, values in recorded.traces.items():
            ours = np.ascontiguousarray(answers.traces[name][usable])
            differing[name] += int(np.count_nonzero(~_same_bits(values[places[usable]], ours)))
    return total, {name: count for name, count in differing.items() if count}


def _switching(given: ReplayInput, runs: list[tuple[Times, Column]]) -> Switching:
    found = Switching()
    for stamps, active in runs:
        on, off = switching_times((stamps - given.zero) / 1e9, active)
        found.on += on.tolist()
        found.off += off.tolist()
    return found


def _same_bits(a: Column, b: Column) -> NDArray[np.bool_]:
    one, other = (np.ascontiguousarray(values, float).view(np.int64) for values in (a, b))
    return (one == other) | (np.isnan(a) & np.isnan(b))
