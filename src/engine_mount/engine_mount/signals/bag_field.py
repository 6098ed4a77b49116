"""One number of the messages of a topic as a signal."""

import numpy as np

from engine_mount.recordings.recording import ReadingError, Recording
from engine_mount.recordings.series import Series, SeriesError, Times
from engine_mount.signals.signal import SECOND, Signal, SignalError, check_count


def read_field(recording: Recording, topic: str, field: str) -> Signal:
    """Return `field` of `topic` over the stamps of the messages, else over the times of arrival.

    Samples whose value is unknown (NaN) are left out, with a note, as is what the recording lacks; raises
    `SignalError`.
    """
    try:
        series = recording[topic]
        values = series[field]
    except (ReadingError, SeriesError) as error:
        raise SignalError(str(error)) from None
    name = f'{topic}.{field}'
    stamps = _stamps(series)
    clock = 'header stamps'
    if stamps is None:
        stamps, clock = series.receive_times, 'times of arrival (the messages carry none of their own)'
    known = np.isfinite(values)
    unknown = int(np.count_nonzero(~known))
    check_count(name, len(values) - unknown)
    stamps = stamps[known]
    notes = [*recording.warnings, *([f'{unknown} samples without a number are left out'] if unknown else [])]
    return Signal(name, (stamps - stamps[0]) / SECOND, values[known], int(stamps[0]), clock, tuple(notes))


def _stamps(series: Series) -> Times | None:
    """Return the stamps (ns), None where the messages have none or never set them."""
    try:
        stamps = series.stamps
    except SeriesError:
        return None
    return stamps if np.any(stamps > 0) else None
