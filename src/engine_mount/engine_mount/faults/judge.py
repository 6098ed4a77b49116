"""What the graph did about one fault, from what was observed, and whether that is what it must do."""

import math
import re
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from typing import Any

from engine_mount.faults.case import SAFE, FaultCase, Reaction
from engine_mount.faults.observers import Observers, Told, since
from mount_models.sampling import HIGHEST_CURRENT
from mount_ros.nodes.diagnostics import Level

AFTER_DETECTION = 0.020  # s: 0 A on the bus, from the first sign that the fault was detected
AFTER_OCCURRENCE = 0.050  # s: 0 A on the bus, from the beginning of silence
_NO_CURRENT = 0.05  # A, chosen: the coil with less gives the pads hardly any force
_LATENESS = re.compile('no (displacement|setpoint) ')  # of a machine with other work
_REMEDY = re.compile(r'[;:?,] *\w+ \w+')


@dataclass
class Course:
    """One trial of a fault: its times (steady clock, s) and what was printed; NaN where it did not come."""

    begun: float
    cleared: float = math.nan
    damping_again: float = math.nan
    over: float = math.nan  # until when it was observed
    ended: bool = False  # the graph has come to its end
    printed: tuple[Told, ...] = ()  # new lines of the command's output

    @property
    def end(self) -> float:
        """When the fault was taken away, or the trial was over."""
        return self.over if math.isnan(self.cleared) else self.cleared


@dataclass
class Outcome:
    """One row of the table; times in s since the fault began, None where it did not happen."""

    detected_by: str = ''
    detected_s: float | None = None
    zero_s: float | None = None
    sentence: str = ''
    recovered: bool = False
    recovery: str = ''
    coil_current_a: float | None = None  # at the end of the fault
    highest_current_a: float = 0.0  # on the bus while it lasted
    complaints: list[str] = field(default_factory=list)
    late: list[str] = field(default_factory=list)  # complaints about time alone
    earlier: list[str] = field(default_factory=list)  # what was wrong with trials before this one
    seen: bool = False  # the fault was injected

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
        return {**asdict(self), 'ok': self.ok}


@dataclass(frozen=True)
class _Evidence:
    """What the requirements are checked against."""

    case: FaultCase
    course: Course
    outcome: Outcome
    reported: list[Told]
    last_wanted: float  # A, current that was wanted of the coil last
    initialised: bool  # before it damped again


def judged(case: FaultCase, course: Course, observed: Observers) -> Outcome:
    """Return what one trial of a fault has shown."""
    heard = [(each.time, each.current) for each in since(observed.heard, course.begun, course.end)]
    seen = since(observed.seen, course.begun, course.end)
    wanted = [(each.time, each.followed) for each in seen] if case.in_electronics else heard
    reported = [*since(observed.told, course.begun, course.over), *course.printed]
    zero = _zero(case, course, wanted)
    outcome = Outcome(
        seen=True,
        zero_s=None if zero is None else round(zero - course.begun, 4),
        coil_current_a=round(seen[-1].coil_current, 3) if seen else None,
        highest_current_a=round(max((current for _, current in heard), default=0.0), 4),
        recovered=not (course.ended or case.for_good or math.isnan(course.damping_again)),
        recovery=_recovery(case, course),
    )
    _note_report(outcome, case, course, reported, zero)
    initialised = any(course.begun < each < course.damping_again for each in observed.initialised)
    last = wanted[-1][1] if wanted else math.nan
    evidence = _Evidence(case, course, outcome, reported, last, initialised)
    for requirement in (_within_limit, *_REQUIRED[case.reaction]):
        outcome.complaints += requirement(evidence)
    for requirement in _IN_TIME[case.reaction]:
        outcome.late += requirement(evidence)
    return outcome


def tells(case: FaultCase, told: Told) -> bool:
    """Return whether a sentence reports the fault."""
    return told.level >= Level.WARN and bool(case.words) and bool(re.search(case.words, told.sentence))


def _zero(case: FaultCase, course: Course, wanted: list[tuple[float, float]]) -> float | None:
    """Return when the current fell to 0 A (s), for good where the fault demands that; None if it did not.

    `wanted` are times (s) and currents (A) wanted of the coil while the fault is there.
    """
    if case.reaction is Reaction.NOT_STARTED:
        return max((time for time, current in wanted if current > 0.0), default=course.begun)
    if case.reaction not in SAFE:
        return next((time for time, current in wanted if current == 0.0), None)
    driven = max((place for place, (_, current) in enumerate(wanted) if current > 0.0), default=-1)
    return wanted[driven + 1][0] if driven + 1 < len(wanted) else None


def _note_report(
    outcome: Outcome, case: FaultCase, course: Course, reported: list[Told], zero: float | None
) -> None:
    found = [each for each in reported if tells(case, each)]
    times = [zero] if zero is not None and case.reaction in SAFE else []
    if found:
        gravest = max(found, key=lambda each: (each.level, not _lacking(each.sentence), -each.time))
        outcome.sentence, outcome.detected_by = gravest.sentence, found[0].node
        times.append(found[0].time)
    if times and course.begun <= min(times):
        outcome.detected_s = round(min(times) - course.begun, 4)


def _recovery(case: FaultCase, course: Course) -> str:
    if course.ended or case.for_good:
        return ('the drive has ended; ' if course.ended else '') + 'a new start initialises'
    if math.isnan(course.damping_again):
        return 'none'
    after = course.damping_again - course.cleared
    if case.reaction is Reaction.SAFE_UNTIL_INITIALISED:
        return f'after an initialisation, {after:.1f} s'
    return f'by itself after {max(after, 0.0):.2f} s' if case.reaction in SAFE else 'not needed'


def _within_limit(found: _Evidence) -> Iterator[str]:
    if found.outcome.highest_current_a > HIGHEST_CURRENT:
        yield f'{found.outcome.highest_current_a} A on the bus; the limit is {HIGHEST_CURRENT:g} A'


def _reported(found: _Evidence) -> Iterator[str]:
    if not found.outcome.sentence:
        yield 'nothing tells of it'
    else:
        yield from (f'the sentence has no {what}' for what in _lacking(found.outcome.sentence))


def _at_zero(found: _Evidence) -> Iterator[str]:
    if found.outcome.zero_s is None:
        yield f'the current does not stay at 0 A: {found.last_wanted:.2f} A at the end of the fault'


def _discharged(found: _Evidence) -> Iterator[str]:
    current = found.outcome.coil_current_a
    if found.outcome.zero_s is None or found.case.coil_apart:
        return
    if current is None:
        yield 'nobody has seen the current of the coil'
    elif not current < _NO_CURRENT:
        yield f'the coil carries {current:g} A at the end of the fault; the limit is {_NO_CURRENT:g} A'


def _damps_again(found: _Evidence) -> Iterator[str]:
    over = found.course.ended or found.case.for_good
    if over and found.case.reaction is Reaction.SAFE_UNTIL_INITIALISED:
        return
    if not found.outcome.recovered:
        yield 'it does not damp again'


def _initialised(found: _Evidence) -> Iterator[str]:
    if found.outcome.recovered and not found.initialised:
        yield 'it damps again without a new initialisation'


def _ended(found: _Evidence) -> Iterator[str]:
    if not found.course.ended:
        yield 'the graph is started with the fault'


def _without_error(found: _Evidence, late: bool = False) -> Iterator[str]:
    there = [each for each in found.reported if not each.time > found.course.cleared]  # its end may be a step
    for error in [each for each in there if each.level >= Level.ERROR][:1]:
        if late == bool(_LATENESS.search(error.sentence)):
            yield f'{error.node} tells an error: {error.sentence}'


def _in_time(found: _Evidence) -> Iterator[str]:
    zero, detected = found.outcome.zero_s, found.outcome.detected_s
    if zero is None:
        return
    if found.case.silent and zero > AFTER_OCCURRENCE:
        yield f'0 A after {1e3 * zero:.0f} ms; the limit is {1e3 * AFTER_OCCURRENCE:g} ms'
    if detected is not None and zero - detected > AFTER_DETECTION:
        late = 1e3 * (zero - detected)
        yield f'0 A {late:.0f} ms after detection; the limit is {1e3 * AFTER_DETECTION:g} ms'


def _going_on(found: _Evidence) -> Iterator[str]:
    yield from _without_error(found, late=True)
    if found.outcome.zero_s is not None:
        yield f'0 A after {found.outcome.zero_s:.2f} s, though damping should go on'


def _lacking(sentence: str) -> list[str]:
    """Return what a sentence lacks, as far as its form shows."""
    found = {'value': re.search(r'\d', sentence), 'remedy': _REMEDY.search(sentence)}
    return [what for what, there in found.items() if not there]


_SAFE = (_reported, _at_zero, _discharged, _damps_again)
_REQUIRED = {
    Reaction.SAFE_WHILE: _SAFE,
    Reaction.SAFE_UNTIL_INITIALISED: (*_SAFE, _initialised),
    Reaction.NOT_STARTED: (_reported, _ended),
    Reaction.TOLD: (_reported, _damps_again),
    Reaction.TOLERATED: (_without_error, _damps_again),
    Reaction.REFUSED: (_without_error, _damps_again),
}
_IN_TIME = {
    Reaction.SAFE_WHILE: (_in_time,),
    Reaction.SAFE_UNTIL_INITIALISED: (_in_time,),
    Reaction.NOT_STARTED: (),
    Reaction.TOLD: (),
    Reaction.TOLERATED: (_going_on,),
    Reaction.REFUSED: (_going_on,),
}
