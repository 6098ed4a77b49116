"""A displacement recorded by somebody else: chosen by topic and field, checked, scaled, resampled."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mount_bags.run.place import open_run
from mount_bags.signals.even_grid import EvenSignal, evenly_spaced
from mount_bags.signals.loading import is_recording, load_signal
from mount_bags.signals.plausibility import check_size
from mount_bags.signals.resampling import has_step, resampled
from mount_bags.signals.signal import SECOND
from mount_bringup.chosen import Parameters, chosen_specimen, control_parameters
from mount_init.parameters import InitParameters
from mount_models.actuator.closing import ClosingMechanics
from mount_models.arithmetic.averages import mean
from mount_models.force_table import contact_force, current_force_table, offset_current
from mount_models.quantity import with_flattened
from mount_models.sampling import SAMPLE_TIME_NS, sample_time_ns
from mount_replay.given.input import (
    Column,
    ControlRun,
    Messages,
    ReplayError,
    ReplayInput,
    Times,
    dated,
)
from mount_replay.given.ramps import MeasuredGap, measured_gaps
from mount_ros import topics
from mount_ros.messages.force_table import ForceTable
from mount_ros.messages.scalars import ScalarsLayout
from mount_sim.excitation.recorded import LONGEST_GAP

LOWEST_RATE = 100.0  # Hz, chosen: five times the 20 Hz up to which an engine moves on its mounts
DEFAULT_TABLE = 'default'
_DISPLACEMENT = 'displacement'
_ENGINE, _CHASSIS = 'engine_displacement', 'chassis_displacement'
_SHORTEST = 0.5  # s, chosen: four periods of the band


@dataclass(frozen=True)
class ForeignOrder:
    """How a foreign recording becomes a displacement in m: value * scale - offset.

    `fields` is {`displacement`: place} or {`engine_displacement`: place, `chassis_displacement`: place}, a
    place being `/topic.field` of a bag or a column of a CSV, NPY or JSON file. `offset` is in m, or `mean`.
    """

    fields: Mapping[str, str]
    scale: float = 1.0
    offset: str = 'mean'


def foreign_order(maps: list[str], scale: float, offset: str) -> ForeignOrder:
    """Return the order that the options of the command describe, or raise `ReplayError`."""
    fields = {}
    for text in maps:
        name, equals, place = text.partition('=')
        if not (equals and place) or name not in (_DISPLACEMENT, _ENGINE, _CHASSIS):
            raise ReplayError(
                f'--map {text}: write displacement=/topic.field, or engine_displacement=/topic.field and '
                'chassis_displacement=/topic.field'
            )
        fields[name] = place
    if set(fields) not in ({_DISPLACEMENT}, {_ENGINE, _CHASSIS}):
        raise ReplayError(
            f'--map names {" and ".join(fields)}; needed is displacement, or engine_displacement and '
            'chassis_displacement together: the displacement of the mount is their difference'
        )
    if not (math.isfinite(scale) and scale != 0.0):
        raise ReplayError(f'--scale ({scale:g}) must be a number other than 0')
    if offset != 'mean' and not _is_number(offset):
        raise ReplayError(f'--offset {offset!r} must be a number of m, or mean')
    return ForeignOrder(fields, scale, offset)


def foreign_input(path: Path, order: ForeignOrder, parameters: Parameters, gap: MeasuredGap) -> ReplayInput:
    """Return what a foreign recording gives to replay with the force table of `gap`.

    A gap in the samples may be no longer than one period of 8 Hz, because what happened in it cannot be
    interpolated; a longer one, or a rate below `LOWEST_RATE`, is refused. Raises `ReplayError` or
    `SignalError`.
    """
    notes: list[str] = []
    signals = {name: _signal(path, place, LONGEST_GAP, notes) for name, place in order.fields.items()}
    control = control_parameters(parameters)
    stamps, values = _on_one_grid(signals, control.sample_rate, notes)
    if stamps[0] < SECOND:  # a time that begins at 0 leaves no room for an activation before it
        stamps = stamps - stamps[0] + SECOND
    values = order.scale * values
    offset = mean(values) if order.offset == 'mean' else float(order.offset)
    notes.append(
        f'factor {order.scale:g} to m; offset {1e3 * offset:.3f} mm removed '
        f'({"the mean" if order.offset == "mean" else "as given"})'
    )
    if order.offset == 'mean':
        notes.append('without its mean the rest position is taken as 0; --offset keeps another one')
    displacement = values - offset
    largest = control.displacement_range
    check_size(
        f'displacement at {_rate_text(control.sample_rate)}', displacement,
        1.0 / control.sample_rate, largest, 'm',
        f'with factor {order.scale:g} to m: is its unit another one (--scale) or its zero (--offset), or is '
        'this sample a fault to cut or repair?',
    )  # fmt: skip
    notes.append(f'largest displacement {1e3 * float(np.max(np.abs(displacement))):.3f} mm')
    run = ControlRun(stamps, displacement, dated(gap, int(stamps[0]) - SAMPLE_TIME_NS))
    layout = ScalarsLayout(topics.DISPLACEMENT)
    pairs = zip(stamps.tolist(), displacement.tolist(), strict=True)
    messages = Messages('/' + _DISPLACEMENT, [layout.pack(stamp, (value,)) for stamp, value in pairs], stamps)
    given = {_DISPLACEMENT: messages}
    name = f'{path.parent.name}/{path.name}' if path.name == 'recording' else path.name
    source = f'{name}: ' + ', '.join(order.fields.values())
    plain = {node: dict(values) for node, values in parameters.items()}
    return ReplayInput(source, [run], plain, None, given, int(stamps[0]), 0, {}, notes)


def default_gap(parameters: Parameters) -> MeasuredGap:
    """Return the nominal gaps and the force table of the specimen in use, as if just measured."""
    specimen, nominal = chosen_specimen(parameters), ClosingMechanics()
    light_pressure = with_flattened(InitParameters(), parameters.get('mount_init', {})).light_pressure
    rest, contact = nominal.rest_gap, nominal.contact_gap
    law, spring = specimen.force_law, specimen.spring_stiffness
    table = current_force_table(law, spring, specimen.pad_stiffness, rest, contact, specimen.current_limit)
    numbers = {
        'rest_gap': rest,
        'contact_gap': contact,
        'rest_gap_std': 0.0,
        'contact_gap_std': 0.0,
        'contact_force': contact_force(spring, rest, contact),
        'offset_current': offset_current(law, spring, rest, contact, light_pressure),
    }
    return MeasuredGap(0, numbers, ForceTable(0, table[0], table[1]))


def chosen_gap(table: str, parameters: Parameters) -> tuple[MeasuredGap, str]:
    """Return the last measured gap of the recording `table`, or the default one, and a sentence on which."""
    if table in ('', DEFAULT_TABLE):
        gap, name = default_gap(parameters), chosen_specimen(parameters).name
        rest, contact = (1e6 * gap.numbers[which] for which in ('rest_gap', 'contact_gap'))
        return gap, (
            f'current-force table: calculated for the specimen {name!r} with the nominal gaps {rest:.0f} um '
            f'at rest and {contact:.0f} um in contact; nothing was measured on this mount'
        )
    recording = open_run(Path(table))
    gaps = measured_gaps(recording)
    if not gaps:
        raise ReplayError(f'--table {table}: that recording holds no air_gap with its current_force_table')
    return gaps[-1], f'current-force table: measured in {Path(table).name} at {gaps[-1].stamp / 1e9:.3f} s'


# Signals.


def _signal(path: Path, place: str, longest_gap: float, notes: list[str]) -> EvenSignal:
    if is_recording(path):
        topic, dot, field = place.partition('.')
        if not dot:
            raise ReplayError(f'--map {place}: name a field too, as in {topic}.field')
        signal = load_signal(path, column=field, topic=topic)
    else:
        signal = load_signal(path, column=place)
    even = evenly_spaced(signal, longest_gap, LOWEST_RATE)
    notes.append(f'{place}: {len(signal.values)} samples at {even.rate:.4g} Hz, by their {signal.clock}')
    notes += [f'{place}: {note}' for note in even.notes]
    return even


def _on_one_grid(
    signals: dict[str, EvenSignal], sample_rate: float, notes: list[str]
) -> tuple[Times, Column]:
    """Return stamps of `sample_rate` (Hz) and the displacement on them, not scaled."""
    step, step_ns = 1.0 / sample_rate, sample_time_ns(sample_rate)
    begin = max(even.begin for even in signals.values())
    end = min(even.begin + round(even.length * SECOND) for even in signals.values())
    count = round((end - begin) / step_ns) + 1
    if count * step < _SHORTEST:
        spans = '; '.join(
            f'{even.name}: {even.begin / 1e9:.3f} .. {even.begin / 1e9 + even.length:.3f} s'
            for even in signals.values()
        )
        raise ReplayError(f'no overlap of {_SHORTEST:g} s or more: {spans}')
    columns = {
        name: resampled(even, step, (begin - even.begin) / SECOND, count)[:] for name, even in signals.items()
    }
    notes += [
        f'{even.name}: resampled from {even.rate:.4g} Hz to {_rate_text(sample_rate)}, band-limited'
        for even in signals.values()
        if not has_step(even, step)
    ]
    stamps = begin + step_ns * np.arange(count, dtype=np.int64)
    if _DISPLACEMENT in columns:
        return stamps, columns[_DISPLACEMENT]
    return stamps, columns[_ENGINE] - columns[_CHASSIS]


def _rate_text(sample_rate: float) -> str:
    return f'{sample_rate / 1000.0:g} kHz'


def _is_number(text: str) -> bool:
    try:
        return math.isfinite(float(text))
    except ValueError:
        return False
