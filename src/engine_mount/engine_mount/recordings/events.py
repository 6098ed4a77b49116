"""What happened in a recording: its marks, and the switching of damping where no mark tells of it."""

import re
from dataclasses import dataclass

import numpy as np

from engine_mount.recordings.recording import Recording
from engine_mount.recordings.series import Series, SeriesError
from engine_mount.recordings.switching import switching_places
from engine_mount.recordings.time_axis import TimeAxis
from mount_recorder.topic_groups import registered_topic
from mount_ros.messages.event import Mark, read_mark
from mount_ros.topics import CONTROL_TRACE, EVENT

SWITCH_ON, SWITCH_OFF = 'switch_on', 'switch_off'
_ACTIVE = 'damping_active'
_NUMBERED = re.compile(r'(.+?):(\d+)')
_LISTED = 12  # events in a refusal


class EventError(ValueError):
    """An event that was asked for is not in the recording; the text lists those that are."""


@dataclass(frozen=True)
class RecordedEvent:
    """Something worth finding again: when it was logged, and its time on the clock of the stamps, in ns."""

    log_time: int
    stamp: int
    kind: str
    text: str = ''


def recorded_events(recording: Recording) -> list[RecordedEvent]:
    """Return the events in `recording` in the order of their log times.

    They are the marks of the topics `event`, and where these tell of no `switch_on` or no `switch_off`, the
    changes of `damping_active` in the control trace.
    """
    marked = [
        RecordedEvent(log_time, mark.time, mark.kind, mark.text)
        for marks in recorded_marks(recording).values()
        for log_time, mark in marks
    ]
    unmarked = {SWITCH_ON, SWITCH_OFF} - {event.kind for event in marked}
    derived = [event for event in _switching(recording) if event.kind in unmarked] if unmarked else []
    return sorted([*marked, *derived], key=lambda event: event.log_time)


def recorded_marks(recording: Recording) -> dict[str, list[tuple[int, Mark]]]:
    """Return the marks by topic, for each mount has its own `event`; each with its log time (ns)."""
    return {
        name: list(zip(recording[name].receive_times.tolist(), read_marks(recording[name]), strict=True))
        for name, topic in recording.topics.items()
        if registered_topic(name, topic.type) is EVENT
    }


def read_marks(events: Series) -> list[Mark]:
    """Return the marks of a recording in the order in which they were set, from `recording['event']`."""
    messages = zip(events.messages(), events.receive_times.tolist(), strict=True)
    return [read_mark(message.data, received) for message, received in messages]


def find_event(recording: Recording, wanted: str) -> RecordedEvent:
    """Return the event meant by `wanted`: its number from 1, its kind (the first one), or `kind:number`.

    In a kind `-` is as good as `_`. Raises `EventError` with the events that there are.
    """
    events = recorded_events(recording)
    if wanted.isdigit():
        fitting, number = events, int(wanted)
    else:
        match = _NUMBERED.fullmatch(wanted)
        kind, number = (match[1], int(match[2])) if match else (wanted, 1)
        kind = kind.replace('-', '_')
        fitting = [event for event in events if event.kind.replace('-', '_') == kind]
    if not 1 <= number <= len(fitting):
        raise EventError(f'{recording.path} has no event {wanted!r}; {_listed(recording, events)}')
    return fitting[number - 1]


def event_time(event: RecordedEvent, axis: TimeAxis) -> float:
    """Return when an event happened, in s on the time axis of its recording."""
    return axis.of_mark(event.stamp, event.log_time)


def _switching(recording: Recording) -> list[RecordedEvent]:
    if CONTROL_TRACE.name not in recording:
        return []
    try:
        recording.load_columns({CONTROL_TRACE.name: (_ACTIVE,)})
        trace = recording[CONTROL_TRACE.name]
        stamps, received, active = trace.stamps, trace.receive_times, trace[_ACTIVE]
    except SeriesError:
        return []  # no control trace of ours
    order = np.argsort(received, kind='stable')
    if not len(order):
        return []
    switched = switching_places((stamps[order] - stamps[order[0]]) / 1e9, active[order])
    return [
        RecordedEvent(int(received[place]), int(stamps[place]), kind)
        for kind, places in zip((SWITCH_ON, SWITCH_OFF), switched, strict=True)
        for place in order[places].tolist()
    ]


def _listed(recording: Recording, events: list[RecordedEvent]) -> str:
    if not events:
        return 'it has none, and damping was never switched; cut by --from and --to'
    axis = recording.time_axis
    shown = [
        f'{number} {event.kind} at {event_time(event, axis):.3f} s'
        for number, event in enumerate(events[:_LISTED], 1)
    ]
    more = f' and {len(events) - _LISTED} more' if len(events) > _LISTED else ''
    return f'it has {", ".join(shown)}{more}'
