"""All faults by name, each with its meaning and what it changes."""

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from mount_models.sampling import HIGHEST_CURRENT
from mount_sim.electronics.electronics import Reading
from mount_sim.electronics.faults import frames
from mount_sim.electronics.faults.fault import Fault, Kind
from mount_sim.electronics.warm_coil import REFERENCE_CELSIUS, TemperatureCoefficients

if TYPE_CHECKING:
    from mount_sim.plant.plant import Plant

_CLOCK_JUMP = 10_000_000  # us, chosen: farther than any pause of the frames
_STEP = 2e-3  # m, chosen
_OUT_OF_RANGE = 0.045  # m, chosen: the signal can carry it, no mount moves so far
_NOISE = 0.3e-3  # m, standard deviation, chosen: 150 times that of a sound sensor
_FAR = 0.6e-3  # m, chosen: its change of sign within 1 ms is 1.2 m/s, and no mount moves faster than 1 m/s
_DRIFT = 1e-3  # m/s, chosen
_RIPPLE_NOISE = 0.2  # 1, standard deviation, chosen: 20 times that of a sound measurement
_RIPPLE_SCALE = 1.3  # 1, chosen
_DEAD_SUPPLY = 0.05  # V, chosen: next to nothing, for the law of the ripple divides by it
_HALF = 0.5
_SOUND_TURNS = 0.5  # share, chosen: the others are shorted; the current in them is left out
_HOTTER = 0.4  # 1: rise of the resistance
_WORN = 200e-6  # m, chosen: contact gap; less is left of the pads than the air gap of 349 um needs
_HALVES_MEET = 20e-6  # m, chosen: gap at which the core halves touch where no pad is between them
_BLOCKING = 1e9  # N/m, chosen: stiffness of what lies between the halves


def _displacement(meaning: str, change: Callable[[Fault, float], float]) -> Kind:
    def reading(fault: Fault, reading: Reading) -> Reading:
        return reading._replace(displacement=change(fault, reading.displacement))

    return Kind(meaning, reading=reading)


def _noisy(fault: Fault, displacement: float) -> float:
    return displacement + _NOISE * float(fault.random.normal(1, 1)[0, 0])


def _flipped(fault: Fault, displacement: float) -> float:
    fault.count += abs(displacement) > _FAR
    return -displacement if fault.count else displacement


def _drifting(fault: Fault, displacement: float) -> float:
    fault.drift += _DRIFT / fault.sample_rate
    return displacement + fault.drift


def _ripple_noisy(fault: Fault, reading: Reading) -> Reading:
    current, flux = 1.0 + _RIPPLE_NOISE * math.sqrt(0.5) * fault.random.normal(1, 2)[0]
    return reading._replace(
        current_rate=float(current) * reading.current_rate, flux_rate=float(flux) * reading.flux_rate
    )


def _reported(meaning: str, **status: Any) -> Kind:
    return Kind(meaning, status=lambda _, sound: sound._replace(**status), on_bus=True)


def _supply(meaning: str, volts: float) -> Kind:
    """The status reports the voltage and the current loop has it."""

    def plant(fault: Fault, plant: 'Plant') -> 'Plant':
        return plant._replace(coil=plant.coil._replace(link_voltage=max(volts, _DEAD_SUPPLY)))

    return Kind(meaning, status=lambda _, sound: sound._replace(supply_voltage=volts), plant=plant)


def _coil_shorted(fault: Fault, plant: 'Plant') -> 'Plant':
    """Half of the resistance, a quarter of the inductance and of the force."""
    return plant._replace(
        coil=plant.coil._replace(resistance=_SOUND_TURNS * plant.coil.resistance),
        actuator=plant.actuator._replace(turns=_SOUND_TURNS * plant.actuator.turns),
    )


def _coil_hot(fault: Fault, plant: 'Plant') -> 'Plant':
    celsius = REFERENCE_CELSIUS + _HOTTER / (plant.temperature.copper or TemperatureCoefficients().copper)
    return plant._replace(electronics=plant.electronics._replace(coil_temperature=fault.keep(celsius)))


def _mechanics(meaning: str, *, scale: float | None = None, **changes: float) -> Kind:
    """The closing mechanics have other values, and the friction another scale."""

    def plant(fault: Fault, plant: 'Plant') -> 'Plant':
        friction = plant.friction if scale is None else plant.friction._replace(scale=scale)
        return plant._replace(mechanics=plant.mechanics._replace(**changes), friction=friction)

    return Kind(meaning, plant=plant)


def _bus(meaning: str, change: Any = None, **options: Any) -> Kind:
    return Kind(meaning, frames=change, on_bus=True, **options)


FAULTS: dict[str, Kind] = {
    'can_silent': _bus('no frames are sent', frames.none_sent),
    'bus_off': _bus(
        'an error frame tells of bus off, then no frame passes either way', frames.bus_off, deaf=True
    ),
    'lost_1': _bus('1 % of the frames are lost, at random', frames.lost(0.01)),
    'lost_5': _bus('5 % of the frames are lost, at random', frames.lost(0.05)),
    'lost_50': _bus('50 % of the frames are lost, at random', frames.lost(0.5)),
    'delayed': _bus('frames arrive 5 ms late', frames.delayed(5)),
    'delayed_50': _bus('frames arrive 50 ms late', frames.delayed(50)),  # later than the setpoint timeout
    'duplicated': _bus('each frame arrives twice', frames.duplicated),
    'reordered': _bus('the frames of every tenth sample arrive behind those of the next', frames.reordered),
    'frozen_counter': _bus('all measurements carry the same alive counter', frames.frozen_counter),
    'wrong_crc': _bus('the frames of every third sample are damaged', frames.damaged(frames.change_byte)),
    'wrong_length': _bus(
        'the frames of every third sample are 4 bytes too short', frames.damaged(frames.shorten)
    ),
    'replayed': _bus('behind each frame comes one of 100 samples ago once more', frames.replayed),
    'babbling': _bus('5 frames with foreign identifiers in each sample', frames.babbling),
    'deaf': _bus('setpoints are not received', deaf=True),
    'clock_jump': _bus(
        'the microsecond counter is 10 s ahead', counters=lambda _, count: (count[0], count[1] + _CLOCK_JUMP)
    ),
    'clock_drift': _bus('the microsecond counter runs 1000 ppm too fast', counters=frames.drifting_clock),
    'counter_wrap': _bus(
        'sample and microsecond counter go through 0 at that time',
        counters=frames.wrapping_counters,
        from_start=True,
    ),
    'electronics_reset': _bus(
        'no power for 100 ms: no frames, 0 A, then all counters from 0',
        lambda fault, sent: [] if fault.deaf else sent,
        counters=frames.reset_counters,
        current=lambda fault, wanted: 0.0 if fault.deaf else wanted,
        deaf=True,
        duration=0.1,
        for_good=True,
    ),
    'displacement_invalid': _displacement('displacements are marked as not valid', lambda *_: math.nan),
    'displacement_stuck': _displacement('the displacement sensor repeats its reading', Fault.keep),
    'displacement_step': _displacement('displacements are read 2 mm too high', lambda _, x: x + _STEP),
    'displacement_out_of_range': _displacement(
        'displacements are read as 45 mm and marked as valid', lambda *_: _OUT_OF_RANGE
    ),
    'displacement_noisy': _displacement('white noise of 0.3 mm on the displacement', _noisy),
    'displacement_inverted': _displacement('displacements have the wrong sign', lambda _, x: -x),
    'displacement_flipped': _displacement(
        'displacements have the wrong sign from the next beyond 0.6 mm on', _flipped
    ),
    'displacement_drifting': _displacement("the displacement sensor's zero moves by 1 mm/s", _drifting),
    'ripple_missing': Kind(
        'the ripple measurement gives nothing',
        reading=lambda _, sound: sound._replace(current_rate=math.nan, flux_rate=math.nan),
    ),
    'ripple_noisy': Kind('the slopes of the ripple scatter by 20 %', reading=_ripple_noisy),
    'ripple_scale': Kind(
        'the slope of the current is read 30 % too high',
        reading=lambda _, sound: sound._replace(current_rate=_RIPPLE_SCALE * sound.current_rate),
    ),
    'coil_open': Kind('the coil carries no current', current=lambda *_: 0.0),
    'coil_shorted': Kind('half of the turns are shorted', plant=_coil_shorted),
    'coil_hot': Kind(
        'coil and core at 122.6 degC: 40 % more resistance, and reported',
        status=lambda fault, sound: sound._replace(coil_temperature_celsius=fault.kept),
        plant=_coil_hot,
        on_bus=True,
    ),
    'coil_half': Kind(
        'the coil carries half of the wanted current', current=lambda _, wanted: _HALF * wanted
    ),
    'coil_stuck': Kind('the coil carries 3 A, whatever is wanted', current=lambda *_: HIGHEST_CURRENT),
    'coil_stuck_on': Kind(
        'the coil keeps the current that was wanted, also when it is switched off', current=Fault.keep
    ),
    'supply_0': _supply('no supply, and reported', 0.0),
    'supply_5': _supply('supply of 5 V, and reported', 5.0),
    'supply_9': _supply('supply of 9 V, and reported', 9.0),
    'supply_16': _supply('supply of 16 V, and reported', 16.0),
    'supply_24': _supply('supply of 24 V, and reported', 24.0),
    'over_current': _reported('the status reports it', over_current=True),
    'over_temperature': _reported('the status reports it', over_temperature=True),
    'under_voltage': _reported('the status reports it', under_voltage=True),
    'temperature_250': _reported('the status says 250 degC', coil_temperature_celsius=250.0),
    'displacement_sensor': _reported(
        'the status reports it; displacements are marked as valid', displacement_sensor=True
    ),
    'pads_worn': _mechanics('the pads touch at a gap of 200 um only', contact_gap=_WORN),
    'pads_missing': _mechanics('the core halves meet, and nothing rubs', contact_gap=_HALVES_MEET, scale=0.0),
    'gap_blocked': _mechanics(
        'the core halves do not move, nothing presses on the pads', spring_stiffness=_BLOCKING
    ),
}
