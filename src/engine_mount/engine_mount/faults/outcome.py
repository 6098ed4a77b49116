"""What the graph did about one fault, from what was observed, and whether that is what it must do."""

import math
import re
from dataclasses import dataclass, field
from typing import Any

from engine_mount.faults.fault import SAFE, FaultCase, Reaction
from engine_mount.faults.observers import Observers, Told, since
from mount_models.sampling import HIGHEST_CURRENT
from mount_ros.nodes.diagnostics import Level

AFTER_DETECTION = 0.020  # s: 0 A on the bus, from the first sign that the fault was detected
AFTER_OCCURRENCE = 0.050  # s: 0 A on the bus, from the beginning of silence
_NO_CURRENT = 0.05  # A, chosen: the coil with less gives the pads hardly any force
_LATENESS = re.compile('no (displacement|setpoint) ')  # of a machine with other work
_REMEDY = re.compile(r'[;:?,] *\w+ \w+')


Wanted = list[tuple[float, float]]
"""Times (s) and currents (A)."""


@dataclass
class Course:
    """One trial of a fault: its times (steady clock, s) and what was printed; NaN where it did not come."""

    begun: float
    cleared: float = math.nan
    damping_again: float = math.nan
    over: float = math.nan  # until when it was observed
    ended: bool = False  # the graph has come to its end
    printed: tuple[Told, ...] = ()  # new lines of the command's output


@dataclass
class Outcome:
    """One row of the table; times in s since the fault began, None where it did not happen."""

    detected_by: str = ''
    detected_s: float | None = None
    zero_s: float | None = None
    coil_current: float | None = None  # A, at the end of the fault
    sentence: str = ''
    recovered: bool = False
    recovery: str = ''
    highest_current: float = 0.0  # A, on the bus while it lasted
    complaints: list[str] = field(default_factory=list)
    late: list[str] = field(default_factory=list)  # complaints about time alone
    seen: bool = False  # the fault was brought in
    earlier: list[str] = field(default_factory=list)  # what was wrong with trials before this one

    @property
    def ok(self) -> bool:
        """Whether the graph did what it must."""
        return not self.complaints and not self.late

    @property
    def wrong(self) -> str:
        """What is not as required; empty where nothing is."""
        return '; '.join([*self.complaints, *self.late])

    def as_json(self) -> dict[str, Any]:
        """Return the row for a file."""
        return {
            'detected_by': self.detected_by,
            'detected_s': self.detected_s,
            'zero_s': self.zero_s,
            'sentence': self.sentence,
            'recovered': self.recovered,
            'ok': self.ok,
            'recovery': self.recovery,
            'coil_current_a': self.coil_current,
            'highest_current_a': self.highest_current,
            'complaints': self.complaints,
            'late': self.late,
            'earlier': self.earlier,
        }


def judged(case: FaultCase, course: Course, observed: Observers) -> Outcome:
    """Return what one trial of a fault has shown."""
    outcome = Outcome(seen=True)
    end = course.over if math.isnan(course.cleared) else course.cleared
    heard, seen = since(observed.heard, course.begun, end), since(observed.seen, course.begun, end)
    told = [*since(observed.told, course.begun, course.over), *course.printed]
    wanted = _wanted(case, course, observed)
    zero = _zero(case, course, wanted)
    _note_telling(outcome, case, course, told, zero)
    if zero is not None:
        outcome.zero_s = round(zero - course.begun, 4)
    if seen:
        outcome.coil_current = round(seen[-1].coil_current, 3)
    outcome.highest_current = round(max((each.current for each in heard), default=0.0), 4)
    _note_recovery(outcome, case, course)
    _check_initialised(outcome, case, course, observed)
    if outcome.highest_current > HIGHEST_CURRENT:
        outcome.complaints.append(
            f'{outcome.highest_current} A on the bus; the limit is {HIGHEST_CURRENT:g} A'
        )
    _CHECKS[case.reaction](outcome, case, course, told, wanted)
    return outcome


def _wanted(case: FaultCase, course: Course, observed: Observers) -> Wanted:
    """Return times (s) and currents (A) wanted of the coil while the fault is there."""
    end = course.over if math.isnan(course.cleared) else course.cleared
    if case.in_electronics:
        return [(each.time, each.followed) for each in since(observed.seen, course.begun, end)]
    return [(each.time, each.current) for each in since(observed.heard, course.begun, end)]


def _zero(case: FaultCase, course: Course, wanted: Wanted) -> float | None:
    """Return when the current fell to 0 A (s), for good where the fault demands that; None if it did not."""
    if case.reaction is Reaction.NOT_STARTED:
        return max((time for time, current in wanted if current > 0.0), default=course.begun)
    if case.reaction not in SAFE:
        return next((time for time, current in wanted if current == 0.0), None)
    driven = max((place for place, (_, current) in enumerate(wanted) if current > 0.0), default=-1)
    return wanted[driven + 1][0] if driven + 1 < len(wanted) else None


def tells(case: FaultCase, told: Told) -> bool:
    """Return whether a sentence tells of the fault."""
    return told.level >= Level.WARN and bool(case.words) and bool(re.search(case.words, told.sentence))


def _note_telling(
    outcome: Outcome, case: FaultCase, course: Course, told: list[Told], zero: float | None
) -> None:
    found = [each for each in told if tells(case, each)]
    times = [zero] if zero is not None and case.reaction in SAFE else []
    if found:
        gravest = max(found, key=lambda each: (each.level, not _lacking(each.sentence), -each.time))
        outcome.sentence, outcome.detected_by = gravest.sentence, found[0].node
        times.append(found[0].time)
    if times and course.begun <= min(times):
        outcome.detected_s = round(min(times) - course.begun, 4)


def _note_recovery(outcome: Outcome, case: FaultCase, course: Course) -> None:
    if course.ended or case.for_good:
        what = 'the drive has ended; ' if course.ended else ''
        outcome.recovery = f'{what}a new start initialises'
    elif not math.isnan(course.damping_again):
        outcome.recovered = True
        after = course.damping_again - course.cleared
        if case.reaction is Reaction.SAFE_UNTIL_INITIALISED:
            outcome.recovery = f'after an initialisation, {after:.1f} s'
        elif case.reaction in SAFE:
            outcome.recovery = f'by itself after {max(after, 0.0):.2f} s'
        else:
            outcome.recovery = 'not needed'
    else:
        outcome.recovery = 'none'


def _check_initialised(outcome: Outcome, case: FaultCase, course: Course, observed: Observers) -> None:
    initialised = [each for each in observed.initialised if course.begun < each < course.damping_again]
    if case.reaction is Reaction.SAFE_UNTIL_INITIALISED and outcome.recovered and not initialised:
        outcome.complaints.append('it damps again without a new initialisation')


def _check_safe(outcome: Outcome, case: FaultCase, course: Course, told: list[Told], wanted: Wanted) -> None:
    _check_sentence(outcome)
    if outcome.zero_s is None:
        last = wanted[-1][1] if wanted else math.nan
        outcome.complaints.append(f'the current does not stay at 0 A: {last:.2f} A at the end of the fault')
        return
    if not case.coil_apart:
        _check_discharged(outcome)
    if case.silent and outcome.zero_s > AFTER_OCCURRENCE:
        outcome.late.append(
            f'0 A after {1e3 * outcome.zero_s:.0f} ms; the limit is {1e3 * AFTER_OCCURRENCE:g} ms'
        )
    if outcome.detected_s is not None and outcome.zero_s - outcome.detected_s > AFTER_DETECTION:
        late = 1e3 * (outcome.zero_s - outcome.detected_s)
        outcome.late.append(f'0 A {late:.0f} ms after detection; the limit is {1e3 * AFTER_DETECTION:g} ms')
    over = course.ended or case.for_good
    if not outcome.recovered and not (over and case.reaction is Reaction.SAFE_UNTIL_INITIALISED):
        outcome.complaints.append('it does not damp again')


def _check_discharged(outcome: Outcome) -> None:
    if outcome.coil_current is None:
        outcome.complaints.append('nobody has seen the current of the coil')
    elif not outcome.coil_current < _NO_CURRENT:
        outcome.complaints.append(
            f'the coil carries {outcome.coil_current:g} A at the end of the fault; the limit is '
            f'{_NO_CURRENT:g} A'
        )


def _check_not_started(
    outcome: Outcome, case: FaultCase, course: Course, told: list[Told], wanted: Wanted
) -> None:
    _check_sentence(outcome)
    if not course.ended:
        outcome.complaints.append('the graph is started with the fault')


def _check_told(outcome: Outcome, case: FaultCase, course: Course, told: list[Told], wanted: Wanted) -> None:
    _check_sentence(outcome)
    if not outcome.recovered:
        outcome.complaints.append('it does not damp again')


def _check_tolerated(
    outcome: Outcome, case: FaultCase, course: Course, told: list[Told], wanted: Wanted
) -> None:
    there = [each for each in told if not each.time > course.cleared]  # its end may be a step of its own
    errors = [each for each in there if each.level >= Level.ERROR]
    if errors:
        complaints = outcome.late if _LATENESS.search(errors[0].sentence) else outcome.complaints
        complaints.append(f'{errors[0].node} tells an error: {errors[0].sentence}')
    if outcome.zero_s is not None:
        outcome.late.append(f'0 A after {outcome.zero_s:.2f} s, though damping should go on')
    if not outcome.recovered:
        outcome.complaints.append('it does not damp any more')


def _check_sentence(outcome: Outcome) -> None:
    if outcome.sentence:
        outcome.complaints += [f'the sentence has no {what}' for what in _lacking(outcome.sentence)]
    else:
        outcome.complaints.append('nothing tells of it')


def _lacking(sentence: str) -> list[str]:
    """Return what a sentence lacks, as far as its form shows."""
    found = {'value': re.search(r'\d', sentence), 'remedy': _REMEDY.search(sentence)}
    return [what for what, there in found.items() if not there]


_CHECKS = {
    Reaction.SAFE_WHILE: _check_safe,
    Reaction.SAFE_UNTIL_INITIALISED: _check_safe,
    Reaction.NOT_STARTED: _check_not_started,
    Reaction.TOLD: _check_told,
    Reaction.TOLERATED: _check_tolerated,
    Reaction.REFUSED: _check_tolerated,
}
