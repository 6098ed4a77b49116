"""Which faults are there when: told before a run, or injected during it."""

import math
import re
import zlib
from collections import deque
from collections.abc import Collection, Iterable
from typing import TYPE_CHECKING, NamedTuple

from mount_driver.can_library import can
from mount_driver.protocol import Status
from mount_models.quantity import ParameterError
from mount_models.sampling import SAMPLE_RATE
from mount_sim.electronics.electronics import Reading
from mount_sim.electronics.faults.contract import Fault, Occasion
from mount_sim.electronics.faults.kinds import FAULTS

if TYPE_CHECKING:
    from mount_sim.plant.plant import Plant

FORM = 'NAME@t[:duration], times in s of simulated time since the activation of mount_sim'
_LONGEST = 7200.0  # s, chosen: as long as a run can be
_NUMBER = r'[0-9.]+(?:e-?[0-9]+)?'
_TOLD = re.compile(rf'(?P<name>\w+)@(?P<begin>{_NUMBER})(?::(?P<duration>{_NUMBER}))?')
_INJECTED = re.compile(rf'(?P<name>\w+)(?::(?P<duration>{_NUMBER}))?')


class ToldFault(NamedTuple):
    """A fault of a name for a while, times in s; `injected` if it came during the run."""

    name: str
    begin: float
    end: float
    injected: bool = False


def told_faults(texts: Iterable[str]) -> list[ToldFault]:
    """Return the faults of texts `NAME@t[:duration]`, which stay without one; raises `ParameterError`."""
    return [_told(text, _TOLD, FORM) for text in texts]


def injected_faults(text: str) -> list[ToldFault]:
    """Return the faults of a text `NAME[:duration], ...`, as they begin at 0 s; raises `ParameterError`."""
    form = 'NAME[:duration], NAME ..., durations in s'
    found = [_told(part.strip(), _INJECTED, form) for part in text.split(',') if part.strip()]
    for fault in found:
        if FAULTS[fault.name].from_start:
            raise ParameterError(
                f'{fault.name} begins with a run: give it in `faults`, as in {fault.name}@10'
            )
    return found


def texts_of_mount(texts: Iterable[str], mount: str, mounts: Collection[str]) -> list[str]:
    """Return the texts that hold for `mount`, without its name: `right/NAME...`; without one all have it.

    `mounts` are the names of all, '' where there is one alone. Raises `ParameterError` for another name.
    """
    found = []
    for text in texts:
        name, slash, fault = text.rpartition('/')
        if slash and name not in mounts:
            known = ', '.join(each for each in mounts if each)
            reason = f'known are {known}' if known else 'there is one mount alone'
            raise ParameterError(f'fault {text!r:.60} names no mount: {reason}')
        if not slash or name == mount:
            found.append(fault)
    return found


def check_without_bus(texts: Iterable[str]) -> None:
    """Raise `ParameterError` for a fault that shows on the bus only, where there is none."""
    for told in told_faults(texts):
        if FAULTS[told.name].on_bus:
            raise ParameterError(
                f'fault {told.name} shows on the CAN bus only, and a run in core has none: drive in real time'
            )


class Faults:
    """The faults of one run; everything it returns passes all that are present.

    `inject` and `end_injected` may be called from any thread.
    """

    def __init__(self, texts: Iterable[str] = (), seed: int = 0, sample_rate: float = SAMPLE_RATE):
        self._sample_rate = sample_rate
        self.present: tuple[Fault, ...] = ()
        """The faults that are there since the last `look`."""
        self._told = told_faults(texts)
        self._seed = seed
        self._running: dict[ToldFault, Fault] = {}
        self._orders: deque[ToldFault | None] = deque()  # None: end what was injected
        self._injected: list[str] = []
        self._change = min((self._begin(told) for told in self._told), default=math.inf)

    @property
    def none_told(self) -> bool:
        """Whether no fault was told before the run."""
        return not self._told

    def due(self, time: float) -> bool:
        """Whether faults begin or end at `time` (s), so that `look` is needed."""
        return time >= self._change

    def look(self, time: float) -> None:
        """Begin and end what is due at `time` (s)."""
        while self._orders:
            self._take(self._orders.popleft(), time)
        self._running = {
            told: self._running.get(told) or self._begun(told)
            for told in self._told
            if self._begin(told) <= time < _end(told)
        }
        self.present = tuple(self._running.values())
        times = (moment for told in self._told for moment in (self._begin(told), _end(told)))
        self._change = min((moment for moment in times if moment > time), default=math.inf)
        if self._orders:  # one that came meanwhile
            self._change = -math.inf

    def inject(self, text: str) -> str:
        """Begin the faults in `text` with the next sample; return what is told of it, or raise."""
        found = injected_faults(text)
        if not found:
            raise ParameterError('inject names no fault; set it to such as "coil_open, lost_5:2"')
        self._orders.extend(found)
        self._injected += [told.name for told in found]
        self._change = -math.inf
        begun = (
            f'{told.name} for {told.end:g} s' if math.isfinite(told.end) else told.name for told in found
        )
        return f'begun: {", ".join(begun)}'

    def end_injected(self) -> str:
        """End all injected faults with the next sample; return what is told of it."""
        names, self._injected = self._injected, []
        self._orders.append(None)
        self._change = -math.inf
        return f'ended: {", ".join(names)}' if names else 'no fault was injected'

    # What the faults change.

    def reading(self, reading: Reading) -> Reading:
        """Return what the sensors give."""
        for fault in self.present:
            reading = fault.reading(reading)
        return reading

    def counted(self, sample: int, microseconds: int) -> tuple[int, int]:
        """Return sample counter and clock of the electronics."""
        for fault in self.present:
            sample, microseconds = fault.counted(sample, microseconds)
        return sample, microseconds

    def on_bus(self, frames: list[can.Message]) -> list[can.Message]:
        """Return the frames that the bus carries."""
        for fault in self.present:
            frames = fault.on_bus(frames)
        return frames

    def status(self, status: Status) -> Status:
        """Return what the electronics say of themselves."""
        for fault in self.present:
            status = fault.status(status)
        return status

    def driven(self, wanted: float) -> float:
        """Return the current (A) that the power stage drives where `wanted` (A) is asked of it."""
        for fault in self.present:
            wanted = fault.driven(wanted)
        return wanted

    def plant(self, plant: 'Plant') -> 'Plant':
        """Return the plant, sound as given, as it is with the faults."""
        for fault in self.present:
            plant = fault.plant(plant)
        return plant

    @property
    def deaf(self) -> bool:
        """Whether setpoints are lost."""
        return any(fault.deaf for fault in self.present)

    @property
    def restarts(self) -> bool:
        """Whether the electronics begin anew with this sample."""
        return any(fault.restarts for fault in self.present)

    def _take(self, order: ToldFault | None, time: float) -> None:
        if order is None:
            self._told = [told for told in self._told if not told.injected or FAULTS[told.name].for_good]
        else:
            self._told.append(order._replace(begin=time, end=time + order.end, injected=True))

    def _begun(self, told: ToldFault) -> Fault:
        seed = (self._seed, zlib.crc32(told.name.encode()))
        return FAULTS[told.name].fault(Occasion(told.begin, told.end, seed, self._sample_rate))

    @staticmethod
    def _begin(told: ToldFault) -> float:
        return 0.0 if FAULTS[told.name].from_start else told.begin


def _end(told: ToldFault) -> float:
    return math.inf if FAULTS[told.name].for_good else told.end


def _told(text: str, pattern: re.Pattern[str], form: str) -> ToldFault:
    found = pattern.fullmatch(text)
    if found is None:
        raise ParameterError(f'fault {text!r:.60} is not written as {form}')
    name = found['name']
    if name not in FAULTS:
        raise ParameterError(f'fault {name!r} is unknown; known are {", ".join(FAULTS)}')
    begin = _time(text, found.groupdict().get('begin') or '0')
    duration = _time(text, found['duration']) if found['duration'] else FAULTS[name].duration
    if duration <= 0.0:
        raise ParameterError(f'fault {text!r}: its duration must be longer than 0 s')
    return ToldFault(name, begin, begin + duration)


def _time(text: str, number: str) -> float:
    try:
        value = float(number)
    except ValueError:
        value = math.inf
    if not value <= _LONGEST:
        raise ParameterError(f'fault {text!r}: a time ({number} s) must lie within 0 .. {_LONGEST:g} s')
    return value
