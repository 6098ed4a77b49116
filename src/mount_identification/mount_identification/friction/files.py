"""Friction recordings from files of any format that is read here, and from recordings in topics.

Units end here: everything behind is in SI units.
"""

from pathlib import Path

import numpy as np

from mount_bags.run.place import open_run
from mount_identification.friction.channels import DESIRED, NEEDED, Channel, columns_in_si
from mount_identification.friction.damper_file import is_damper, read_damper
from mount_identification.friction.recording import (
    FrictionRecording,
    IdentificationError,
    checked_recording,
)
from mount_identification.rack.measured_table import MeasuredTable, in_topics

TOPICS = {
    'displacement': ('displacement', 'mount'),
    'friction_force': ('sim/mount_force', 'wrench.force.z'),
    'normal_force': ('sim/clamp_force', 'wrench.force.z'),
}


def read_recording(
    path: Path, channels: dict[str, Channel] | None = None, clamp: str = 'sliding'
) -> FrictionRecording:
    """Return the checked recording in `path`; `channels` name columns or topics, `clamp` see `read_damper`.

    Raises `IdentificationError` and the readers' errors.
    """
    chosen = channels or {}
    if not path.exists():
        raise IdentificationError(
            f'{path} does not exist; give a file of measured columns, or a recording or its folder'
        )
    if in_topics(path):
        return _mcap(path, chosen)
    if path.suffix.lower() == '.json' and is_damper(path):
        return read_damper(path, chosen, clamp)
    return _rack(MeasuredTable(path), chosen)


def _rack(table: MeasuredTable, channels: dict[str, Channel]) -> FrictionRecording:
    columns = columns_in_si(table, channels, NEEDED)
    return checked_recording(
        table.path.name, columns['time'], columns['displacement'], columns['friction_force'],
        columns['normal_force'], columns.get(DESIRED),
    )  # fmt: skip


def _mcap(path: Path, channels: dict[str, Channel]) -> FrictionRecording:
    if 'time' in channels:
        raise IdentificationError(
            f'{path}: the times of a recording are its stamps; leave --channel '
            f'time={channels["time"].source} out'
        )
    recording = open_run(path)
    series = {}
    for name in (*NEEDED, *({DESIRED} & channels.keys())):
        topic, field = TOPICS.get(name, ('', ''))
        factor = 1.0
        if name in channels:
            topic, _, field = channels[name].source.partition('.')
            factor = channels[name].factor or 1.0
        if topic not in recording:
            raise IdentificationError(
                f'{path} has no topic {topic} (for {name}); it has {", ".join(recording) or "none"}: name '
                f'one as in --channel {name}=/topic.field'
            )
        one = recording[topic]
        if not len(one):
            raise IdentificationError(f'{path}: {topic} has 0 messages; at least 50 are needed')
        series[name] = (np.asarray(one.time, float), factor * np.asarray(one[field], float))
    time, displacement = series['displacement']
    first, last = (pick(each[0][place] for each in series.values()) for pick, place in ((max, 0), (min, -1)))
    inside = (time >= first) & (time <= last)
    time = time[inside]
    matched = {name: np.interp(time, *each) for name, each in series.items() if name != 'displacement'}
    return checked_recording(
        path.name, time, displacement[inside], matched['friction_force'], matched['normal_force'],
        matched.get(DESIRED),
    )  # fmt: skip
