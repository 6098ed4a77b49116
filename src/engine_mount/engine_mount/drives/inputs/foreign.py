"""A displacement recorded by somebody else: chosen by column or field, checked, resampled."""

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from engine_mount.drives.inputs.consumed_samples import ControlRun, MeasuredGap, ReplayError
from engine_mount.drives.inputs.input import Messages, ReplayInput, measured_gaps
from engine_mount.recordings.place import open_run
from engine_mount.settings.chosen import Parameters, chosen_specimen, control_parameters
from engine_mount.signals.even_grid import evenly_spaced
from engine_mount.signals.excitation import LONGEST_GAP
from engine_mount.signals.formats.content import Stated
from engine_mount.signals.importing.channels import (
    CHASSIS,
    DISPLACEMENT,
    ENGINE,
    LOWEST_RATE,
    displacement_on_grid,
    rate_text,
)
from engine_mount.signals.mapping import MEAN, Mapping, mapping_in_file, with_options
from engine_mount.signals.quantities import QUANTITIES
from engine_mount.signals.selection import select
from engine_mount.signals.signal import SECOND, check_size
from mount_init.parameters import InitParameters
from mount_models.actuator import contact_force, current_force_table, offset_current
from mount_models.arithmetic.sums import mean
from mount_models.quantity import with_flattened
from mount_models.sampling import SAMPLE_TIME_NS
from mount_ros import topics
from mount_ros.messages.force_table import ForceTable
from mount_ros.messages.scalars import ScalarsLayout
from mount_sim.plant.closing import ClosingMechanics

DEFAULT_TABLE = 'default'
_QUANTITIES = {name: QUANTITIES[name] for name in (DISPLACEMENT, ENGINE, CHASSIS)}


@dataclass(frozen=True)
class ForeignOrder:
    """How a foreign recording becomes a displacement in m: its columns in SI, less `offset` (m, or `mean`).

    `mapping` names `displacement`, or `engine_displacement` and `chassis_displacement`.
    """

    mapping: Mapping
    offset: str = MEAN


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
    """Return the order that the options of the command describe, or raise a `ValueError`.

    `maps` are `NAME=COLUMN[:UNIT]`, `time` is `COLUMN[:UNIT]`. Without `offset` it is that of the mapping
    file, else the mean.
    """
    mapping = mapping_in_file(mapping_file) if mapping_file else Mapping()
    mapping = replace(mapping.of(_QUANTITIES), option='--map {quantity}={column}:{unit}')
    mapping = with_options(mapping, maps, time, rate, scale, known=_QUANTITIES, stated=stated)
    if set(mapping.columns) not in ({DISPLACEMENT}, {ENGINE, CHASSIS}):
        raise ReplayError(
            f'--map names {" and ".join(mapping.columns) or "nothing"}; needed is displacement, or '
            'engine_displacement and chassis_displacement together: the displacement of the mount is their '
            'difference'
        )
    said = next((one.offset for one in mapping.columns.values() if one.offset is not None), MEAN)
    offset = offset or str(said)
    if offset != MEAN and not _is_number(offset):
        raise ReplayError(f'--offset {offset!r} must be a number of m, or mean')
    # subtracted at the rate of the controller, from the difference of both
    return ForeignOrder(
        mapping.only({name: replace(one, offset=None) for name, one in mapping.columns.items()}), offset
    )


def foreign_input(path: Path, order: ForeignOrder, parameters: Parameters, gap: MeasuredGap) -> ReplayInput:
    """Return what a foreign recording gives to replay with the force table of `gap`.

    A gap in the samples may be no longer than one period of 8 Hz, because what happened in it cannot be
    interpolated; a longer one, or a rate below `LOWEST_RATE`, is refused. Raises `ReplayError` or
    `SignalError`.
    """
    selection, control = select(path, order.mapping), control_parameters(parameters)
    columns = {name: choice.column for name, choice in order.mapping.columns.items()}
    notes, even = list(selection.notes), {}
    for name, signal in selection.signals.items():
        even[name] = evenly_spaced(signal, LONGEST_GAP, LOWEST_RATE)
        count, rate = len(signal.values), even[name].rate
        notes.append(f'{columns[name]}: {count} samples at {rate:.4g} Hz, by their {signal.clock}')
        notes += signal.notes
        notes += [f'{columns[name]}: {note}' for note in even[name].notes[len(signal.notes) :]]
    stamps, values = displacement_on_grid(even, control.sample_rate, notes)
    if stamps[0] < SECOND:  # a time that begins at 0 leaves no room for an activation before it
        stamps = stamps - stamps[0] + SECOND
    offset = mean(values) if order.offset == MEAN else float(order.offset)
    scale = ' and '.join({f'{told["factor"]:g}': None for told in selection.columns.values()})
    notes.append(
        f'factor {scale} to m; offset {1e3 * offset:.3f} mm removed '
        f'({"the mean" if order.offset == MEAN else "as given"})'
    )
    if order.offset == MEAN:
        notes.append('without its mean the rest position is taken as 0; --offset keeps another one')
    displacement = values - offset
    check_size(
        f'{selection.name}: displacement at {rate_text(control.sample_rate)}', displacement,
        1.0 / control.sample_rate, control.displacement_range, 'm',
        f'with factor {scale} to m: is its unit another one (--scale) or its zero (--offset), or is '
        'this sample a fault to cut or repair?',
    )  # fmt: skip
    notes.append(f'largest displacement {1e3 * float(np.max(np.abs(displacement))):.3f} mm')
    run = ControlRun(stamps, displacement, gap.dated(int(stamps[0]) - SAMPLE_TIME_NS))
    layout = ScalarsLayout(topics.DISPLACEMENT)
    pairs = zip(stamps.tolist(), displacement.tolist(), strict=True)
    messages = Messages('/' + DISPLACEMENT, [layout.pack(stamp, (value,)) for stamp, value in pairs], stamps)
    name = f'{path.parent.name}/{path.name}' if path.name == 'recording' else path.name
    plain = {node: dict(values) for node, values in parameters.items()}
    return ReplayInput(
        f'{name}: {", ".join(columns.values())}', [run], plain, None, {DISPLACEMENT: messages},
        int(stamps[0]), 0, {}, notes,
    )  # fmt: skip


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


def _is_number(text: str) -> bool:
    try:
        return math.isfinite(float(text))
    except ValueError:
        return False
