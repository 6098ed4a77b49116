"""A displacement recorded by somebody else: chosen by column or field, checked, scaled, resampled."""

import math
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from engine_mount.drives.inputs.consumed_samples import ControlRun, MeasuredGap, ReplayError
from engine_mount.drives.inputs.input import Messages, ReplayInput, measured_gaps
from engine_mount.recordings.place import open_run
from engine_mount.settings.chosen import Parameters, chosen_specimen, control_parameters
from engine_mount.signals.even_grid import EvenSignal, evenly_spaced
from engine_mount.signals.excitation import LONGEST_GAP
from engine_mount.signals.formats.content import Stated
from engine_mount.signals.importing.one_grid import (
    CHASSIS,
    DISPLACEMENT,
    ENGINE,
    LOWEST_RATE,
    displacement_on_grid,
    rate_text,
)
from engine_mount.signals.plausibility import check_size
from engine_mount.signals.signal import SECOND
from engine_mount.signals.units.columns import place, read_chosen
from engine_mount.signals.units.mapping import MEAN, Mapping, checked_scale, mapping_in_file, with_options
from engine_mount.signals.units.signals import ChosenSignal, chosen_signals
from mount_init.parameters import InitParameters
from mount_models.arithmetic.averages import mean
from mount_models.force_table import contact_force, current_force_table, offset_current
from mount_models.quantity import with_flattened
from mount_models.sampling import SAMPLE_TIME_NS
from mount_ros import topics
from mount_ros.messages.force_table import ForceTable
from mount_ros.messages.scalars import ScalarsLayout
from mount_sim.plant.closing import ClosingMechanics

DEFAULT_TABLE = 'default'
_FIELDS = (DISPLACEMENT, ENGINE, CHASSIS)


@dataclass(frozen=True)
class ForeignOrder:
    """How a foreign recording becomes a displacement in m: its columns in SI, less `offset`.

    `mapping` names `displacement`, or `engine_displacement` and `chassis_displacement`. `offset` is in m, or
    `mean`. `mapping_file` is where the mapping was read from, '' where options alone say it.
    """

    mapping: Mapping
    offset: str = MEAN
    mapping_file: str = ''
    stated: Stated = field(default_factory=Stated)


def foreign_order(
    maps: list[str],
    scale: float | None = None,
    offset: str = '',
    *,
    mapping_file: Path | None = None,
    time: str = '',
    rate: float | None = None,
    stated: Stated | None = None,
) -> ForeignOrder:
    """Return the order that the options of the command describe, or raise `ReplayError`.

    `maps` are `NAME=COLUMN[:UNIT]`, `time` is `COLUMN[:UNIT]`. Without `offset` it is that of the mapping
    file, else the mean.
    """
    for text in maps:
        name, equals, place = text.partition('=')
        if not (equals and place) or name not in _FIELDS:
            raise ReplayError(
                f'--map {text}: write displacement=/topic.field, or engine_displacement=/topic.field and '
                'chassis_displacement=/topic.field'
            )
    mapping = mapping_in_file(mapping_file) if mapping_file else Mapping()
    mapping = with_options(mapping, maps, time, rate)
    columns = {name: choice for name, choice in mapping.columns.items() if name in _FIELDS}
    if set(columns) not in ({DISPLACEMENT}, {ENGINE, CHASSIS}):
        raise ReplayError(
            f'--map names {" and ".join(columns) or "nothing"}; needed is displacement, or '
            'engine_displacement and chassis_displacement together: the displacement of the mount is their '
            'difference'
        )
    if scale is not None:
        columns = {
            name: replace(choice, scale=checked_scale(scale, '--scale')) for name, choice in columns.items()
        }
    if offset not in ('', MEAN) and not _is_number(offset):
        raise ReplayError(f'--offset {offset!r} must be a number of m, or mean')
    said = next((choice.offset for choice in columns.values() if choice.offset is not None), MEAN)
    options = '--map {quantity}={column}:{unit}'
    return ForeignOrder(
        replace(mapping, columns=columns, others={}, options=options), offset or str(said),
        mapping_file.name if mapping_file else '', stated or Stated(),
    )  # fmt: skip


def foreign_input(path: Path, order: ForeignOrder, parameters: Parameters, gap: MeasuredGap) -> ReplayInput:
    """Return what a foreign recording gives to replay with the force table of `gap`.

    A gap in the samples may be no longer than one period of 8 Hz, because what happened in it cannot be
    interpolated; a longer one, or a rate below `LOWEST_RATE`, is refused. Raises `ReplayError` or
    `SignalError`.
    """
    measured = read_chosen(str(path), order.mapping, order.stated)
    notes = list(measured.notes)
    chosen = chosen_signals(measured, order.mapping)
    control = control_parameters(parameters)
    even, scale, done = _even(order, chosen)
    notes += done
    stamps, values = displacement_on_grid(even, control.sample_rate, notes)
    if stamps[0] < SECOND:  # a time that begins at 0 leaves no room for an activation before it
        stamps = stamps - stamps[0] + SECOND
    values = scale * values
    offset = mean(values) if order.offset == MEAN else float(order.offset)
    notes.append(
        f'factor {scale:g} to m; offset {1e3 * offset:.3f} mm removed '
        f'({"the mean" if order.offset == MEAN else "as given"})'
    )
    if order.offset == MEAN:
        notes.append('without its mean the rest position is taken as 0; --offset keeps another one')
    displacement = values - offset
    largest = control.displacement_range
    check_size(
        f'{place(measured)}: displacement at {rate_text(control.sample_rate)}', displacement,
        1.0 / control.sample_rate, largest, 'm',
        f'with factor {scale:g} to m: is its unit another one (--scale) or its zero (--offset), or is '
        'this sample a fault to cut or repair?',
    )  # fmt: skip
    notes.append(f'largest displacement {1e3 * float(np.max(np.abs(displacement))):.3f} mm')
    run = ControlRun(stamps, displacement, gap.dated(int(stamps[0]) - SAMPLE_TIME_NS))
    layout = ScalarsLayout(topics.DISPLACEMENT)
    pairs = zip(stamps.tolist(), displacement.tolist(), strict=True)
    messages = Messages('/' + DISPLACEMENT, [layout.pack(stamp, (value,)) for stamp, value in pairs], stamps)
    given = {DISPLACEMENT: messages}
    name = f'{path.parent.name}/{path.name}' if path.name == 'recording' else path.name
    columns = order.mapping.columns.values()
    source = f'{name}: ' + ', '.join(choice.column for choice in columns)
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


def _even(
    order: ForeignOrder, chosen: dict[str, ChosenSignal]
) -> tuple[dict[str, EvenSignal], float, list[str]]:
    """Return the signals evenly spaced, the factor to m that they have in common, and what was done."""
    factors = {one.factor for one in chosen.values()}
    common = factors.pop() if len(factors) == 1 else None
    even, notes = {}, []
    for name, one in chosen.items():
        signal = one.signal if common is not None else replace(one, offset=None).in_si()
        found = evenly_spaced(signal, LONGEST_GAP, LOWEST_RATE)
        column = order.mapping.columns[name].column
        notes.append(
            f'{column}: {len(signal.values)} samples at {found.rate:.4g} Hz, by their {signal.clock}'
        )
        notes += signal.notes
        notes += [f'{column}: {note}' for note in found.notes[len(signal.notes) :]]
        even[name] = found
    return even, 1.0 if common is None else common, notes


def _is_number(text: str) -> bool:
    try:
        return math.isfinite(float(text))
    except ValueError:
        return False
