"""What the recorder looks at in passing: the stamps of streams, the switching of damping, faults of nodes."""

from collections.abc import Callable

from mount_models.sampling import SAMPLE_RATE
from mount_recorder.automatic_marks import (
    AutomaticMarks,
    FaultWatch,
    LostSampleWatch,
    MarkKind,
    SwitchOnWatch,
)
from mount_recorder.recorder import Observe, Recorder
from mount_ros.messages.scalars import ScalarsReader, stamp_of
from mount_ros.messages.verdicts import verdicts_of
from mount_ros.topics import CONTROL_TRACE, CURRENT_SETPOINT, DIAGNOSTICS, Delivery, Topic

PresentTime = Callable[[], int]
"""Returns now on the clock of the stamps, ns."""

_HOUR = 3_600_000_000_000  # ns


def watch_topic(
    recorder: Recorder,
    topic: Topic,
    name: str,
    marks: AutomaticMarks,
    namespace: str,
    now: PresentTime,
    sample_rate: float = SAMPLE_RATE,
) -> None:
    """Let `recorder` look at what it receives on `topic`, whose full name is `name`; the rate is in Hz."""
    if topic is DIAGNOSTICS:
        recorder.observe(name, _fault_observer(FaultWatch(marks, namespace), now))
    # Setpoints pause between initialisation and control; the audit knows when, a live count does not.
    elif topic.delivery is Delivery.STREAM and topic is not CURRENT_SETPOINT:
        kind = MarkKind.UNANSWERED if topic is CONTROL_TRACE else MarkKind.LOST_SAMPLE
        watch = recorder.watch(name, topic.rate_at(sample_rate), stamp_of)
        samples = LostSampleWatch(marks, name, watch, kind)
        switching = SwitchOnWatch(marks, _mount(name, namespace)) if topic is CONTROL_TRACE else None
        recorder.observe(name, _stream_observer(samples, switching))


def _mount(name: str, namespace: str) -> str:
    """Return the mount that a topic belongs to, empty where it stands in the recorder's own namespace."""
    return name.rpartition('/')[0].removeprefix(namespace.rstrip('/')).strip('/')


def _stream_observer(samples: LostSampleWatch, switching: SwitchOnWatch | None) -> Observe:
    add = samples.add
    if switching is None:
        return lambda raw, _: add(stamp_of(raw))
    reader = ScalarsReader(('damping_active', 'magnitude'))

    def observe(raw: bytes, _: int) -> None:
        stamp, (active, magnitude) = reader.read(raw)
        add(stamp)
        switching.add(stamp, active, magnitude)

    return observe


def _fault_observer(faults: FaultWatch, now: PresentTime) -> Observe:
    def observe(raw: bytes, _: int) -> None:
        for told in verdicts_of(raw):
            faults.add(now(), told)

    return observe


def present_time(clock: int, last_stamp: int) -> int:
    """Return "now" on the clock of the stamps, ns: the system's unless the stamps run on one of their own.

    In lock-step the stamps begin at 0; then now is the stamp that came last.
    """
    return last_stamp if last_stamp and abs(clock - last_stamp) > _HOUR else clock
