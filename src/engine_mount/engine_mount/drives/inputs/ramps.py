"""The initialisations in a recording: their results, and the ramps whose samples are all there."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from engine_mount.recordings.recording import Recording
from engine_mount.settings.chosen import chosen_specimen
from mount_init.estimate import TemperatureReadings
from mount_init.initialisation import Initialisation
from mount_init.parameters import InitParameters
from mount_models.quantity import with_flattened
from mount_models.specimen import Specimen, SpecimenError
from mount_ros import topics
from mount_ros.messages.force_table import ForceTable, from_message
from mount_ros.messages.scalars import MessageError

Times = NDArray[np.int64]
Column = NDArray[np.float64]


@dataclass(frozen=True)
class MeasuredGap:
    """The result of one initialisation as its two messages carry it; `stamp` (ns) names the activation."""

    stamp: int
    numbers: dict[str, float]  # of the topic air_gap
    table: ForceTable


@dataclass(frozen=True)
class Ramp:
    """The ripple samples that one initialisation took: stamps ns, A, A/s, T/s.

    `temperatures` are the coil temperatures (stamp ns, degC) up to its end; none in older recordings.
    """

    stamps: Times
    coil_current: Column
    current_rate: Column
    flux_rate: Column
    temperatures: tuple[tuple[int, float], ...] = ()

    def samples(self) -> Iterator[tuple[int, float, float, float]]:
        """Return the samples one by one, as an initialisation takes them."""
        columns = (self.stamps, self.coil_current, self.current_rate, self.flux_rate)
        return zip(*(column.tolist() for column in columns), strict=True)


def measured_gaps(recording: Recording) -> list[MeasuredGap]:
    """Return the results of all initialisations in the recording that have both their messages, by stamp."""
    if topics.AIR_GAP.name not in recording or topics.CURRENT_FORCE_TABLE.name not in recording:
        return []
    series, messages = recording[topics.AIR_GAP.name], recording[topics.CURRENT_FORCE_TABLE.name].messages()
    tables = {}
    for message in messages:
        try:
            table = from_message(message)
        except MessageError:
            continue  # a node does not take it either
        tables[table.stamp] = table
    columns = {name: series[name] for name in topics.AIR_GAP.names}
    gaps = {}
    for place, stamp in enumerate(series.stamps.tolist()):
        if stamp in tables:
            numbers = {name: float(column[place]) for name, column in columns.items()}
            gaps[stamp] = MeasuredGap(stamp, numbers, tables[stamp])
    return [gaps[stamp] for stamp in sorted(gaps)]


def ramps_of(
    recording: Recording, parameters: dict[str, dict[str, Any]], gaps: list[MeasuredGap], notes: list[str]
) -> list[Ramp]:
    """Return the ramps that are in the recording from their first sample to their last."""
    needed = (topics.COIL_RIPPLE.name, topics.CURRENT_SETPOINT.name)
    if any(name not in recording or not len(recording[name]) for name in needed) or not gaps:
        return []
    length = _ramp_length(parameters, notes)
    if length is None:
        return []
    ripple = recording[topics.COIL_RIPPLE.name]
    stamps, first = np.unique(ripple.stamps, return_index=True)
    answered = np.intersect1d(stamps, recording[topics.CURRENT_SETPOINT.name].stamps)
    ramps = []
    for gap in gaps:
        taken = answered[answered <= gap.stamp][-length:]
        if len(taken) < length or taken[-1] != gap.stamp:
            notes.append(
                f'the ramp before the air_gap of stamp {gap.stamp / 1e9:.3f} s is not wholly in the '
                'recording; its result is taken as recorded'
            )
            continue
        places = first[np.searchsorted(stamps, taken)]
        ramps.append(
            Ramp(
                taken,
                ripple['coil_current'][places],
                ripple.derivative('coil_current')[places],
                ripple.derivative('flux_density')[places],
                _temperatures(recording, int(taken[-1])),
            )
        )
    return ramps


def initialisation(
    parameters: dict[str, dict[str, Any]], temperatures: Iterable[tuple[int, float]] = ()
) -> Initialisation:
    """Return a ramp of mount_init with these parameters of the nodes, before its first sample.

    `temperatures` are those of the coil (stamp ns, degC).
    """
    readings = TemperatureReadings()
    for stamp, celsius in temperatures:
        readings.take(stamp, celsius)
    return Initialisation(*specimen_and_parameters(parameters), readings)


def specimen_and_parameters(parameters: dict[str, dict[str, Any]]) -> tuple[Specimen, InitParameters]:
    """Return what mount_init is configured with."""
    return chosen_specimen(parameters), with_flattened(InitParameters(), parameters.get('mount_init', {}))


def _temperatures(recording: Recording, end: int) -> tuple[tuple[int, float], ...]:
    """Return the coil temperatures of the recording up to `end` (ns), in the order of their coming."""
    if topics.COIL_TEMPERATURE.name not in recording or not len(recording[topics.COIL_TEMPERATURE.name]):
        return ()
    series = recording[topics.COIL_TEMPERATURE.name]
    pairs = zip(series.stamps.tolist(), series['temperature'].tolist(), strict=True)
    return tuple((stamp, celsius) for stamp, celsius in pairs if stamp <= end)


def _ramp_length(parameters: dict[str, dict[str, Any]], notes: list[str]) -> int | None:
    try:
        return initialisation(parameters).length
    except SpecimenError as error:
        notes.append(f'initialisations are not replayed, their results are taken as recorded: {error}')
        return None
