"""All faults by name, each with what it means."""

import math
from typing import NamedTuple

from mount_sim.electronics.faults import actuator, bus, clock, power, sensors
from mount_sim.electronics.faults.contract import Fault


class Kind(NamedTuple):
    """What a name stands for; `duration` (s) where none is told.

    One `from_start` is there from the first sample on and so cannot come during a run; one `for_good` stays
    behind its end. One `on_bus` shows in frames alone, so not in a core run, which has none.
    """

    meaning: str
    fault: type[Fault]
    duration: float = math.inf
    from_start: bool = False
    for_good: bool = False
    on_bus: bool = False


def _on_bus(meaning: str, fault: type[Fault], **options: float | bool) -> Kind:
    return Kind(meaning, fault, on_bus=True, **options)  # type: ignore[arg-type]


FAULTS: dict[str, Kind] = {
    'can_silent': _on_bus('no frames are sent', bus.Silent),
    'bus_off': _on_bus('an error frame tells of bus off, then no frame passes either way', bus.BusOff),
    'lost_1': _on_bus('1 % of the frames are lost, at random', bus.Lost1),
    'lost_5': _on_bus('5 % of the frames are lost, at random', bus.Lost5),
    'lost_50': _on_bus('50 % of the frames are lost, at random', bus.Lost50),
    'delayed': _on_bus('frames arrive 5 ms late', bus.Delayed),
    'delayed_50': _on_bus('frames arrive 50 ms late', bus.DelayedLong),
    'duplicated': _on_bus('each frame arrives twice', bus.Duplicated),
    'reordered': _on_bus('the frames of every tenth sample arrive behind those of the next', bus.Reordered),
    'frozen_counter': _on_bus('all measurements carry the same alive counter', bus.FrozenCounter),
    'wrong_crc': _on_bus('the frames of every third sample are damaged', bus.WrongCrc),
    'wrong_length': _on_bus('the frames of every third sample are 4 bytes too short', bus.WrongLength),
    'replayed': _on_bus('behind each frame comes one of 100 samples ago once more', bus.Replayed),
    'babbling': _on_bus('5 frames with foreign identifiers in each sample', bus.Babbling),
    'deaf': _on_bus('setpoints are not received', bus.Deaf),
    'clock_jump': _on_bus('the microsecond counter is 10 s ahead', clock.ClockJump),
    'clock_drift': _on_bus('the microsecond counter runs 1000 ppm too fast', clock.ClockDrift),
    'counter_wrap': _on_bus(
        'sample and microsecond counter go through 0 at that time', clock.CounterWrap, from_start=True
    ),
    'electronics_reset': _on_bus(
        'no power for 100 ms: no frames, 0 A, then all counters from 0',
        clock.ElectronicsReset,
        duration=0.1,
        for_good=True,
    ),
    'displacement_invalid': Kind('displacements are marked as not valid', sensors.DisplacementInvalid),
    'displacement_stuck': Kind('the displacement sensor repeats its reading', sensors.DisplacementStuck),
    'displacement_step': Kind('displacements are read 2 mm too high', sensors.DisplacementStep),
    'displacement_out_of_range': Kind(
        'displacements are read as 45 mm and marked as valid', sensors.DisplacementOutOfRange
    ),
    'displacement_noisy': Kind('white noise of 0.3 mm on the displacement', sensors.DisplacementNoisy),
    'displacement_inverted': Kind('displacements have the wrong sign', sensors.DisplacementInverted),
    'displacement_flipped': Kind(
        'displacements have the wrong sign from the next beyond 0.6 mm on', sensors.DisplacementFlipped
    ),
    'displacement_drifting': Kind(
        "the displacement sensor's zero moves by 1 mm/s", sensors.DisplacementDrifting
    ),
    'ripple_missing': Kind('the ripple measurement gives nothing', sensors.RippleMissing),
    'ripple_noisy': Kind('the slopes of the ripple scatter by 20 %', sensors.RippleNoisy),
    'ripple_scale': Kind('the slope of the current is read 30 % too high', sensors.RippleScale),
    'coil_open': Kind('the coil carries no current', power.CoilOpen),
    'coil_shorted': Kind('half of the turns are shorted', actuator.CoilShorted),
    'coil_hot': _on_bus('coil and core at 122.6 degC: 40 % more resistance, and reported', actuator.CoilHot),
    'coil_half': Kind('the coil carries half of the wanted current', power.CoilHalf),
    'coil_stuck': Kind('the coil carries 3 A, whatever is wanted', power.CoilStuck),
    'coil_stuck_on': Kind(
        'the coil keeps the current that was wanted, also when it is switched off', power.CoilStuckOn
    ),
    'supply_0': Kind('no supply, and reported', power.Supply0),
    'supply_5': Kind('supply of 5 V, and reported', power.Supply5),
    'supply_9': Kind('supply of 9 V, and reported', power.Supply9),
    'supply_16': Kind('supply of 16 V, and reported', power.Supply16),
    'supply_24': Kind('supply of 24 V, and reported', power.Supply24),
    'over_current': _on_bus('the status reports it', power.OverCurrent),
    'over_temperature': _on_bus('the status reports it', power.OverTemperature),
    'under_voltage': _on_bus('the status reports it', power.UnderVoltage),
    'temperature_250': _on_bus('the status says 250 degC', power.Temperature250),
    'displacement_sensor': _on_bus(
        'the status reports it; displacements are marked as valid', power.DisplacementSensor
    ),
    'pads_worn': Kind('the pads touch at a gap of 200 um only', actuator.PadsWorn),
    'pads_missing': Kind('the core halves meet, and nothing rubs', actuator.PadsMissing),
    'gap_blocked': Kind('the core halves do not move, nothing presses on the pads', actuator.GapBlocked),
}
