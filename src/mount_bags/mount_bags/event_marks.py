"""Marks in a recording: "here is something worth finding again", one YAML text each on the topic `event`."""

from typing import Any, NamedTuple

import yaml

from mount_bags.series import Series

BY_HAND = 'mark'  # kind of a mark that a person set
_HOUR = 3_600_000_000_000  # ns


class Mark(NamedTuple):
    """What happened when: `time` in ns on the clock of the stamps, one word, one sentence."""

    time: int
    kind: str
    text: str = ''


def mark_text(mark: Mark) -> str:
    """Return the text of the message."""
    return yaml.safe_dump(mark._asdict(), sort_keys=False, allow_unicode=True, width=1 << 20)


def read_mark(text: str, received: int) -> Mark:
    """Return the mark that a message holds; what is not told is `received` (ns), `mark` and no text.

    Anybody may publish a plain sentence on `event`: what is more than these three, or no plain value of
    them, is kept as the whole text.
    """
    content = _mapping(text)
    told = {name: content[name] for name in Mark._fields if isinstance(content.get(name), str)}
    return Mark(
        _whole_number(told.get('time', ''), received),
        told.get('kind', BY_HAND),
        told.get('text', '') if told and len(told) == len(content) else text.strip(),
    )


def read_marks(events: Series) -> list[Mark]:
    """Return the marks of a recording in the order in which they were set, from `recording['event']`."""
    messages = zip(events.messages(), events.receive_times.tolist(), strict=True)
    return [read_mark(message.data, received) for message, received in messages]


def _mapping(text: str) -> dict[Any, Any]:
    try:
        # Every word stays the text that it is: `12:30` is no number, and `2026-02-30` no date.
        content = yaml.load(text, Loader=yaml.BaseLoader)
    except (yaml.YAMLError, RecursionError):
        return {}
    return content if isinstance(content, dict) else {}


def _whole_number(word: str, otherwise: int) -> int:
    try:
        return int(word)
    except ValueError:
        return otherwise


def present_time(clock: int, last_stamp: int) -> int:
    """Return "now" on the clock of the stamps, ns: the system's unless the stamps run on one of their own.

    In lock-step the stamps begin at 0; then now is the stamp that came last.
    """
    return last_stamp if last_stamp and abs(clock - last_stamp) > _HOUR else clock
