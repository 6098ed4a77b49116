"""The air gap of a recording in which none was measured: that of another one, or the nominal one."""

from pathlib import Path

from engine_mount.drives.inputs.consumed_samples import MeasuredGap, ReplayError
from engine_mount.drives.inputs.input import measured_gaps
from engine_mount.recordings.recording import open_run
from engine_mount.settings.chosen import Parameters, chosen_specimen
from mount_init.parameters import InitParameters
from mount_models.actuator import contact_force, current_force_table, offset_current
from mount_models.quantity import with_flattened
from mount_ros.messages.force_table import ForceTable
from mount_sim.plant.closing import ClosingMechanics

DEFAULT_TABLE = 'default'


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


def chosen_gap(table: str) -> tuple[MeasuredGap, str]:
    """Return the last measured gap of the recording `table`, or the default one, and a sentence on which."""
    if table == DEFAULT_TABLE:
        gap, name = default_gap({}), chosen_specimen({}).name
        rest, contact = (1e6 * gap.numbers[which] for which in ('rest_gap', 'contact_gap'))
        return gap, (
            f'current-force table: calculated for the specimen {name!r} with the nominal gaps {rest:.0f} um '
            f'at rest and {contact:.0f} um in contact; nothing was measured on this mount'
        )
    gaps = measured_gaps(open_run(Path(table)))
    if not gaps:
        raise ReplayError(f'--table {table}: that recording holds no air_gap with its current_force_table')
    return gaps[-1], f'current-force table: measured in {Path(table).name} at {gaps[-1].stamp / 1e9:.3f} s'
