"""What the graph did about one fault, from what was observed, and whether that is what it must do."""

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

from engine_mount.faults.case import SAFE, FaultCase, Reaction
from engine_mount.faults.observers import Observers, Report, since
from mount_models.sampling import HIGHEST_CURRENT
from mount_ros.nodes.diagnostics import Level

AFTER_DETECTION = 0.020  # s: 0 A on the bus, from the first sign that the fault was detected
AFTER_OCCURRENCE = 0.050  # s: 0 A on the bus, from the beginning of silence
_NO_CURRENT = 0.05  # A, chosen: the coil with less gives the pads hardly any force
_LATENESS = re.compile('no (displacement|setpoint) ')  # of a machine with other work
_REMEDY = re.compile(r'[;:?,] *\w+ \w+')
_UNDISTURBED = (Reaction.TOLERATED, Reaction.REFUSED)


@dataclass
class Course:
    """One trial of a fault: its times (steady clock, s) and what was printed; NaN where it did not come."""

    begun: float
    cleared: float = math.nan
    damping_again: float = math.nan
    over: float = math.nan  # until when it was observed
    ended: bool = False  # the graph has come to its end
    printed: Sequence[Report] = ()  # new lines of the command's output


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

    @property
    def ok(self) -> bool:
        """Whether the graph did what it must."""
        return not self.wrong

    @property
    def wrong(self) -> str:
        """What is not as required; empty where nothing is."""
        return '; '.join([*self.complaints, *self.late])

    def as_json(self) -> dict[str, Any]:
        """Return the row for a file."""
        return {**asdict(self), 'ok': self.ok}


def judge(case: FaultCase, course: Course, observed: Observers) -> Outcome:
    """Return what one trial of a fault has shown."""
    begun, end = course.begun, course.over if math.isnan(course.cleared) else course.cleared
    frames = [(each.time, each.current) for each in since(observed.setpoints, begun, end)]
    truths = since(observed.truths, begun, end)
    wanted = [(each.time, each.followed) for each in truths] if case.in_electronics else frames
    reports = [*since(observed.reports, begun, course.over), *course.printed]
    zero = _zero(case, begun, wanted)
    outcome = Outcome(
        zero_s=None if zero is None else round(zero - begun, 4),
        coil_current_a=round(truths[-1].coil_current, 3) if truths else None,
        highest_current_a=round(max((current for _, current in frames), default=0.0), 4),
        recovered=not (course.ended or case.for_good or math.isnan(course.damping_again)),
        recovery=_recovery(case, course),
    )
    signs = [zero] if zero is not None and case.reaction in SAFE else []
    if found := [each for each in reports if reports_fault(case, each)]:
        gravest = max(found, key=lambda each: (each.level, not _lacking(each.sentence), -each.time))
        outcome.sentence, outcome.detected_by = gravest.sentence, found[0].node
        signs.append(found[0].time)
    if signs and begun <= min(signs):
        outcome.detected_s = round(min(signs) - begun, 4)
    initialised = any(begun < each < course.damping_again for each in observed.initialisations)
    outcome.complaints += _complaints(
        case, course, outcome, wanted[-1][1] if wanted else math.nan, initialised
    )
    outcome.late += _lateness(case, outcome)
    if case.reaction in _UNDISTURBED:
        errors = [
            each
            for each in reports
            if each.level >= Level.ERROR and not each.time > course.cleared  # its end may be a step
        ]
        for error in errors[:1]:
            kind = outcome.late if _LATENESS.search(error.sentence) else outcome.complaints
            kind.insert(0, f'{error.node} reports an error: {error.sentence}')
    return outcome


def reports_fault(case: FaultCase, report: Report) -> bool:
    """Return whether a sentence reports the fault."""
    return report.level >= Level.WARN and bool(case.words) and bool(re.search(case.words, report.sentence))


def _zero(case: FaultCase, begun: float, wanted: Sequence[tuple[float, float]]) -> float | None:
    """Return when the current fell to 0 A (s), for good where the fault demands that; None if it did not.

    `wanted` are times (s) and currents (A) wanted of the coil while the fault is there.
    """
    if case.reaction is Reaction.NOT_STARTED:
        return max((time for time, current in wanted if current > 0.0), default=begun)
    if case.reaction not in SAFE:
        return next((time for time, current in wanted if current == 0.0), None)
    driven = max((place for place, (_, current) in enumerate(wanted) if current > 0.0), default=-1)
    return wanted[driven + 1][0] if driven + 1 < len(wanted) else None


def _recovery(case: FaultCase, course: Course) -> str:
    if course.ended or case.for_good:
        return ('the drive has ended; ' if course.ended else '') + 'a new start initialises'
    if math.isnan(course.damping_again):
        return 'none'
    after = course.damping_again - course.cleared
    if case.reaction is Reaction.SAFE_UNTIL_INITIALISED:
        return f'after an initialisation, {after:.1f} s'
    return f'by itself after {max(after, 0.0):.2f} s' if case.reaction in SAFE else 'not needed'


def _complaints(
    case: FaultCase, course: Course, outcome: Outcome, last_wanted: float, initialised: bool
) -> Iterator[str]:
    """Yield what is not as required, time aside.

    `last_wanted` (A) was wanted of the coil last; `initialised`: before it damped again.
    """
    reaction, coil = case.reaction, outcome.coil_current_a
    if outcome.highest_current_a > HIGHEST_CURRENT:
        yield f'{outcome.highest_current_a} A on the bus; the limit is {HIGHEST_CURRENT:g} A'
    if reaction not in _UNDISTURBED:
        if not outcome.sentence:
            yield 'nothing tells of it'
        else:
            yield from (f'the sentence has no {what}' for what in _lacking(outcome.sentence))
    if reaction is Reaction.NOT_STARTED:
        if not course.ended:
            yield 'the graph is started with the fault'
        return
    if reaction in SAFE and outcome.zero_s is None:
        yield f'the current does not stay at 0 A: {last_wanted:.2f} A at the end of the fault'
    elif reaction in SAFE and not case.coil_apart:
        if coil is None:
            yield 'nobody has seen the current of the coil'
        elif not coil < _NO_CURRENT:
            yield f'the coil carries {coil:g} A at the end of the fault; the limit is {_NO_CURRENT:g} A'
    is_over = course.ended or case.for_good
    is_by_initialisation = reaction is Reaction.SAFE_UNTIL_INITIALISED
    if not outcome.recovered and not (is_over and is_by_initialisation):
        yield 'it does not damp again'
    if outcome.recovered and is_by_initialisation and not initialised:
        yield 'it damps again without a new initialisation'


def _lateness(case: FaultCase, outcome: Outcome) -> Iterator[str]:
    zero, detected = outcome.zero_s, outcome.detected_s
    if zero is None:
        return
    if case.reaction in _UNDISTURBED:
        yield f'0 A after {zero:.2f} s, though damping should go on'
    if case.reaction not in SAFE:
        return
    if case.silent and zero > AFTER_OCCURRENCE:
        yield f'0 A after {1e3 * zero:.0f} ms; the limit is {1e3 * AFTER_OCCURRENCE:g} ms'
    if detected is not None and zero - detected > AFTER_DETECTION:
        late = 1e3 * (zero - detected)
        yield f'0 A {late:.0f} ms after detection; the limit is {1e3 * AFTER_DETECTION:g} ms'


def _lacking(sentence: str) -> list[str]:
    """Return what a sentence lacks, as far as its form shows."""
    found = {'value': re.search(r'\d', sentence), 'remedy': _REMEDY.search(sentence)}
    return [what for what, there in found.items() if not there]
