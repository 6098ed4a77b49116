"""All faults by name: what each changes, and which are present when, told before a run or injected."""

import math
import re
import zlib
from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from functools import cache, cached_property
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

from mount_driver.bus import Frame
from mount_driver.can_library import can
from mount_models.quantity import ParameterError, nearest
from mount_models.sampling import HIGHEST_CURRENT, SAMPLE_RATE
from mount_sim.electronics.vehicle_bus import speed_signal
from mount_sim.plant.ripple import REFERENCE_CELSIUS, TemperatureCoefficients
from mount_sim.random_numbers import RandomNumbers

if TYPE_CHECKING:
    from mount_driver.protocol import MountCodec

Frames = list[can.Message]
Change = Callable[['Fault', Any], Any] | None
"""What becomes of a value while a fault is present."""


class Kind(NamedTuple):
    """What a name stands for, and what it changes while it is present.

    All but `plant` is called once in each sample, in the order in which it stands here: `reading` of the
    sensors; sample counter and clock (us) as `counters`, which may pass their widths; `frames` that the bus
    carries in this sample; `status` of the electronics; `current` (A) that the power stage drives.
    `duration` (s) holds where the text names none.
    """

    meaning: str
    reading: Change = None
    counters: Change = None
    frames: Change = None
    status: Change = None
    current: Change = None
    plant: Change = None
    deaf: bool = False
    """Setpoints are not received."""
    duration: float = math.inf
    from_start: bool = False
    """It is present from the first sample on and so cannot begin during a run."""
    for_good: bool = False
    """It stays after its end."""
    on_bus: bool = False
    """It shows in frames alone, so not in a core run, which has none."""


@dataclass(eq=False)
class Fault:
    """One occurrence of a fault: its times in s of simulated time, and what it remembers."""

    name: str
    kind: Kind
    begin: float
    end: float
    seed: int = 0
    sample_rate: float = SAMPLE_RATE
    injected: bool = False
    """It came during the run."""
    deaf: bool = False
    restarts: bool = False
    """The electronics begin anew with this sample, their counters of frames and setpoint too."""
    count: int = 0
    drift: float = 0.0
    kept: float = math.nan
    """The first value, which the fault repeats."""
    past: deque[Frames] = field(default_factory=deque)

    @property
    def times(self) -> tuple[float, float]:
        """From when on (s) it is present, and when no longer."""
        kind = self.kind
        return 0.0 if kind.from_start else self.begin, math.inf if kind.for_good else self.end

    @cached_property
    def random(self) -> RandomNumbers:
        """Random numbers of this occurrence."""
        return RandomNumbers((self.seed, zlib.crc32(self.name.encode())))

    def keep(self, value: float) -> float:
        """Return the first number of the `value`s since the fault began."""
        if math.isnan(self.kept):
            self.kept = value
        return self.kept


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

# Of the bus and the counters.

_EVERY = 3  # chosen: of so many samples one has damaged frames
_REORDERED = 10  # chosen: of so many samples one overtakes the one before
_REPLAYED = 100  # samples, chosen: age of the frames that are sent again
_BABBLED = 5  # frames in each sample, chosen: about what a bus of 500 kbit/s and 2 Mbit/s can carry besides
_SPEED_ABSURD, _SPEED_WRONG = b'\xff\xff', (4 * 1500).to_bytes(2, 'little')  # chosen: 16383 and 1500 rpm
_LENGTH_LESS = 4  # bytes; CAN FD knows 24 and 20
_BUS_OFF = 0x40  # error class of a SocketCAN error frame, linux/can/error.h
_ERROR_BYTES = 8
_CLOCK_DRIFT = 1000e-6  # 1; the driver follows a quartz of at most 500 ppm
_WIDTH_SAMPLE, _WIDTH_MICROSECOND = 1 << 16, 1 << 32
_US = 1e6  # us per s


def _codec() -> 'MountCodec':
    from mount_driver.protocol import mount_codec  # a run in core needs neither frames nor their protection

    return mount_codec()  # the electronics have loaded it, so no sample waits for it


@cache
def _foreign_identifiers() -> list[int]:
    layouts = _codec().measurement, _codec().setpoint, _codec().status, speed_signal().message
    own = {layout.frame_id for layout in layouts}
    return [number for number in range(0x800) if number not in own]


def _bus_off(fault, frames):
    """Send the error frame of a controller that is bus off, then nothing.

    An error frame is local to a controller and no bus carries it. SocketCAN shows the controller's own to the
    driver; here the simulator gives it to the driver over a bus of this machine.
    """
    fault.count += 1
    error = can.Message(arbitration_id=_BUS_OFF, is_error_frame=True, data=bytes(_ERROR_BYTES))
    return [error] if fault.count == 1 else []


def _lost(share):
    """Lose this share of the frames, at random."""

    def some(fault, frames):
        arriving = fault.random.uniform(len(frames)) >= share
        return [frame for frame, arrives in zip(frames, arriving, strict=True) if arrives]

    return some


def _delayed(samples):
    """Delay frames by some samples; those under way when the fault ends are lost."""

    def late(fault, frames):
        fault.past.append(_copies(frames))
        return fault.past.popleft() if len(fault.past) > samples else []

    return late


def _reordered(fault, frames):
    """Send the frames of every tenth sample after those of the next."""
    fault.count += 1
    if fault.count % _REORDERED == 0:
        fault.past.append(_copies(frames))
        return []
    return frames + fault.past.popleft() if fault.past else frames


def _frozen_counter(fault, frames):
    """Give all measurements the same alive counter, with a check sum that is right."""
    codec = _codec()
    for frame in frames:
        if frame.arbitration_id == codec.measurement.frame_id:
            alive, measurement = codec.measurement.decode(frame.data)
            frame.data = codec.encode_measurement(measurement, int(fault.keep(alive)))
    return frames


def _damaged(damage):
    """Damage the frames of every third sample."""

    def some(fault, frames):
        fault.count += 1
        if fault.count % _EVERY == 1:
            for frame in frames:
                damage(frame)
        return frames

    return some


def _change_last_byte(frame):
    frame.data[-1] ^= 0xFF


def _shorten(frame):
    """Remove the last bytes."""
    frame.data = frame.data[:-_LENGTH_LESS]
    frame.dlc = len(frame.data)


def _replayed(fault, frames):
    """Send after each frame one of 100 samples ago once more, as it was."""
    fault.past.append(_copies(frames))
    return frames + fault.past.popleft() if len(fault.past) > _REPLAYED else frames


def _babbling(fault, frames):
    """Add frames of another node, with identifiers that are none of this mount's."""
    foreign, numbers = _foreign_identifiers(), fault.random.uniform(_BABBLED)
    return [
        *frames,
        *(Frame(foreign[int(number * len(foreign))], number.tobytes()) for number in numbers),
    ]


def _speed(sent):
    """Send these two bytes for the speed of the engine, or none of its messages."""

    def changed(fault, frames):
        speed = speed_signal().message.frame_id
        for frame in frames:
            if frame.arbitration_id == speed and sent:
                frame.data[3:5] = sent
        return [frame for frame in frames if sent or frame.arbitration_id != speed]

    return changed


def _drifting_clock(fault, counters):
    """Let the microsecond counter run 1000 ppm too fast."""
    sample, microseconds = counters
    return sample, microseconds + round(_CLOCK_DRIFT * (microseconds - round(fault.begin * _US)))


def _wrapping_counters(fault, counters):
    """Let both counters go through their highest value to 0 when the fault begins."""
    sample, microseconds = counters
    wrap = round(fault.begin * fault.sample_rate)
    return (
        sample + _WIDTH_SAMPLE - wrap % _WIDTH_SAMPLE,
        microseconds + _WIDTH_MICROSECOND - round(wrap / fault.sample_rate * _US),
    )


def _reset_counters(fault, counters):
    """Start both counters from 0 when the power is back; until then no setpoint is received."""
    back = round(fault.end * fault.sample_rate)
    after = counters[0] - back
    fault.deaf, fault.restarts = after < 0, after == 0
    return counters if fault.deaf else (after, round(after / fault.sample_rate * _US))


def _copies(frames):
    """Return the frames as they are now, which no later change of the given ones changes."""
    return [Frame(frame.arbitration_id, bytearray(frame.data)) for frame in frames]


# Of sensors, status and plant.


def _displacement(meaning: str, change: Callable[[Fault, float], float]) -> Kind:
    def reading(fault, reading):
        return reading._replace(displacement=change(fault, reading.displacement))

    return Kind(meaning, reading=reading)


def _noisy(fault, displacement):
    return displacement + _NOISE * float(fault.random.normal(1, 1)[0, 0])


def _flipped(fault, displacement):
    fault.count += abs(displacement) > _FAR
    return -displacement if fault.count else displacement


def _drifting(fault, displacement):
    fault.drift += _DRIFT / fault.sample_rate
    return displacement + fault.drift


def _ripple_noisy(fault, reading):
    current, flux = 1.0 + _RIPPLE_NOISE * math.sqrt(0.5) * fault.random.normal(1, 2)[0]
    return reading._replace(
        current_rate=float(current) * reading.current_rate, flux_rate=float(flux) * reading.flux_rate
    )


def _reported(meaning: str, **status: Any) -> Kind:
    return Kind(meaning, status=lambda _, sound: sound._replace(**status), on_bus=True)


def _supply(meaning: str, volts: float) -> Kind:
    """The status reports the voltage and the current loop has it."""

    def plant(fault, plant):
        return plant._replace(coil=plant.coil._replace(link_voltage=max(volts, _DEAD_SUPPLY)))

    return Kind(meaning, status=lambda _, sound: sound._replace(supply_voltage=volts), plant=plant)


def _coil_shorted(fault, plant):
    """Half of the resistance, a quarter of the inductance and of the force."""
    return plant._replace(
        coil=plant.coil._replace(resistance=_SOUND_TURNS * plant.coil.resistance),
        actuator=plant.actuator._replace(turns=_SOUND_TURNS * plant.actuator.turns),
    )


def _coil_hot(fault, plant):
    celsius = REFERENCE_CELSIUS + _HOTTER / (plant.temperature.copper or TemperatureCoefficients().copper)
    return plant._replace(electronics=plant.electronics._replace(coil_temperature=fault.keep(celsius)))


def _mechanics(meaning: str, *, scale: float | None = None, **changes: float) -> Kind:
    """The closing mechanics have other values, and the friction another scale."""

    def plant(fault, plant):
        friction = plant.friction if scale is None else plant.friction._replace(scale=scale)
        return plant._replace(mechanics=plant.mechanics._replace(**changes), friction=friction)

    return Kind(meaning, plant=plant)


def _bus(meaning: str, change: Any = None, **options: Any) -> Kind:
    return Kind(meaning, frames=change, on_bus=True, **options)


FAULTS: dict[str, Kind] = {
    'can_silent': _bus('no frames are sent', lambda *_: []),
    'bus_off': _bus('an error frame tells of bus off, then no frame passes either way', _bus_off, deaf=True),
    'lost_1': _bus('1 % of the frames are lost, at random', _lost(0.01)),
    'lost_5': _bus('5 % of the frames are lost, at random', _lost(0.05)),
    'lost_50': _bus('50 % of the frames are lost, at random', _lost(0.5)),
    'delayed': _bus('frames arrive 5 ms late', _delayed(5)),
    'delayed_50': _bus('frames arrive 50 ms late', _delayed(50)),  # later than the setpoint timeout
    'duplicated': _bus(
        'each frame arrives twice', lambda _, sent: [frame for frame in sent for _ in range(2)]
    ),
    'reordered': _bus('the frames of every tenth sample arrive behind those of the next', _reordered),
    'frozen_counter': _bus('all measurements carry the same alive counter', _frozen_counter),
    'wrong_crc': _bus('the frames of every third sample are damaged', _damaged(_change_last_byte)),
    'wrong_length': _bus('the frames of every third sample are 4 bytes too short', _damaged(_shorten)),
    'replayed': _bus('behind each frame comes one of 100 samples ago once more', _replayed),
    'babbling': _bus('5 frames with foreign identifiers in each sample', _babbling),
    'engine_speed_stopped': _bus('the vehicle sends the speed of its engine no more', _speed(b'')),
    'engine_speed_absurd': _bus('the vehicle sends a speed that no engine has', _speed(_SPEED_ABSURD)),
    'engine_speed_wrong': _bus('the speed stands at 1500 turns a minute', _speed(_SPEED_WRONG)),
    'deaf': _bus('setpoints are not received', deaf=True),
    'clock_jump': _bus(
        'the microsecond counter is 10 s ahead', counters=lambda _, count: (count[0], count[1] + _CLOCK_JUMP)
    ),
    'clock_drift': _bus('the microsecond counter runs 1000 ppm too fast', counters=_drifting_clock),
    'counter_wrap': _bus(
        'sample and microsecond counter go through 0 at that time',
        counters=_wrapping_counters,
        from_start=True,
    ),
    'electronics_reset': _bus(
        'no power for 100 ms: no frames, 0 A, then all counters from 0',
        lambda fault, sent: [] if fault.deaf else sent,
        counters=_reset_counters,
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


T = TypeVar('T')

FORM = 'NAME@t[:duration], times in s of simulated time since the activation of mount_sim'
_INJECTED = 'NAME[:duration], NAME ..., durations in s'
_LONGEST = 7200.0  # s, chosen: as long as a run can be
_NUMBER = r'[0-9.]+(?:e-?[0-9]+)?'
_WRITTEN = re.compile(rf'(\w+)(?:@({_NUMBER}))?(?::({_NUMBER}))?')


def told_faults(texts: Iterable[str], seed: int = 0, sample_rate: float = SAMPLE_RATE) -> list[Fault]:
    """Return the faults of texts `NAME@t[:duration]`, which stay without one; raises `ParameterError`."""
    return [_fault(text, FORM, seed, sample_rate) for text in texts]


def injected_faults(text: str, seed: int = 0, sample_rate: float = SAMPLE_RATE) -> list[Fault]:
    """Return the faults of a text `NAME[:duration], ...`, as they begin at 0 s; raises `ParameterError`."""
    parts = [part.strip() for part in text.split(',') if part.strip()]
    found = [_fault(part, _INJECTED, seed, sample_rate) for part in parts]
    for fault in found:
        if fault.kind.from_start:
            raise ParameterError(
                f'{fault.name} begins with a run: give it in `faults`, as in {fault.name}@10'
            )
    return found


def check_without_bus(texts: Iterable[str]) -> None:
    """Raise `ParameterError` for a fault that shows on the bus only, where there is none."""
    for fault in told_faults(texts):
        if fault.kind.on_bus:
            raise ParameterError(
                f'fault {fault.name} shows on the CAN bus only, and a run in core has none: '
                'drive in real time'
            )


class Faults:
    """The faults of one run; everything it returns passes all that are present.

    `inject` and `end_injected` may be called from any thread.
    """

    def __init__(self, texts: Iterable[str] = (), seed: int = 0, sample_rate: float = SAMPLE_RATE):
        self._seed, self._sample_rate = seed, sample_rate
        self.present: tuple[Fault, ...] = ()
        """The faults that are present since the last `look`."""
        self._faults = told_faults(dict.fromkeys(texts), seed, sample_rate)
        self._orders: deque[Fault | None] = deque()  # None: end what was injected
        self._injected: list[str] = []
        self._change = self._next_change(-math.inf)

    @property
    def none_told(self) -> bool:
        """Whether no fault was told before the run."""
        return not self._faults

    def due(self, time: float) -> bool:
        """Whether faults begin or end at `time` (s), so that `look` is needed."""
        return time >= self._change

    def look(self, time: float) -> None:
        """Begin and end what is due at `time` (s)."""
        while self._orders:
            self._take(self._orders.popleft(), time)
        self.present = tuple(fault for fault in self._faults if fault.times[0] <= time < fault.times[1])
        self._change = self._next_change(time)
        if self._orders:  # one that came meanwhile
            self._change = -math.inf

    def inject(self, text: str) -> str:
        """Begin the faults in `text` with the next sample; return a sentence about it, or raise."""
        found = injected_faults(text, self._seed, self._sample_rate)
        if not found:
            raise ParameterError('inject names no fault; set it to such as "coil_open, lost_5:2"')
        begun = (
            f'{fault.name} for {fault.end:g} s' if math.isfinite(fault.end) else fault.name for fault in found
        )
        sentence = f'begun: {", ".join(begun)}'
        self._injected += [fault.name for fault in found]
        self._orders.extend(found)
        self._change = -math.inf
        return sentence

    def end_injected(self) -> str:
        """End all injected faults with the next sample; return a sentence about it."""
        names, self._injected = self._injected, []
        self._orders.append(None)
        self._change = -math.inf
        return f'ended: {", ".join(names)}' if names else 'no fault was injected'

    def through(self, part: str, value: T) -> T:
        """Return a value as the faults that are present change it; `part` is a field of `Kind`."""
        for fault in self.present:
            change = getattr(fault.kind, part)
            if change is not None:
                value = change(fault, value)
        return value

    @property
    def deaf(self) -> bool:
        """Whether setpoints are lost."""
        return any(fault.deaf for fault in self.present)

    @property
    def restarts(self) -> bool:
        """Whether the electronics begin anew with this sample."""
        return any(fault.restarts for fault in self.present)

    def _next_change(self, time: float) -> float:
        times = (moment for fault in self._faults for moment in fault.times)
        return min((moment for moment in times if moment > time), default=math.inf)

    def _take(self, order: Fault | None, time: float) -> None:
        if order is None:
            self._faults = [fault for fault in self._faults if not fault.injected or fault.kind.for_good]
        else:
            order.begin, order.end, order.injected = time, time + order.end, True
            self._faults.append(order)


def _fault(text: str, form: str, seed: int, sample_rate: float) -> Fault:
    found = _WRITTEN.fullmatch(text)
    if found is None or (found[2] is None) is (form is FORM):
        raise ParameterError(f'fault {text!r:.60} is not written as {form}')
    name = found[1]
    if name not in FAULTS:
        raise ParameterError(f'fault {name!r} is unknown; {nearest(name, FAULTS)}')
    kind = FAULTS[name]
    begin = _time(text, found[2] or '0')
    duration = _time(text, found[3]) if found[3] else kind.duration
    if duration <= 0.0:
        raise ParameterError(f'fault {text!r}: its duration must be longer than 0 s')
    return Fault(name, kind, begin, begin + duration, seed, sample_rate, deaf=kind.deaf)


def _time(text: str, number: str) -> float:
    try:
        value = float(number)
    except ValueError:
        value = math.inf
    if not value <= _LONGEST:
        raise ParameterError(f'fault {text!r}: a time ({number} s) must lie within 0 .. {_LONGEST:g} s')
    return value
