"""Which faults are there when: told before a run, or injected during it."""

import math
import re
from collections import deque
from collections.abc import Collection, Iterable
from typing import TYPE_CHECKING, TypeVar

from mount_driver.can_library import can
from mount_driver.protocol import Status
from mount_models.quantity import ParameterError
from mount_models.sampling import SAMPLE_RATE
from mount_sim.electronics.electronics import Reading
from mount_sim.electronics.faults.fault import Fault
from mount_sim.electronics.faults.kinds import FAULTS

if TYPE_CHECKING:
    from mount_sim.plant.plant import Plant

T = TypeVar('T')

FORM = 'NAME@t[:duration], times in s of simulated time since the activation of mount_sim'
_LONGEST = 7200.0  # s, chosen: as long as a run can be
_NUMBER = r'[0-9.]+(?:e-?[0-9]+)?'
_TOLD = re.compile(rf'(?P<name>\w+)@(?P<begin>{_NUMBER})(?::(?P<duration>{_NUMBER}))?')
_INJECTED = re.compile(rf'(?P<name>\w+)(?::(?P<duration>{_NUMBER}))?')


def told_faults(texts: Iterable[str], seed: int = 0, sample_rate: float = SAMPLE_RATE) -> list[Fault]:
    """Return the faults of texts `NAME@t[:duration]`, which stay without one; raises `ParameterError`."""
    return [_fault(text, _TOLD, FORM, seed, sample_rate) for text in texts]


def injected_faults(text: str, seed: int = 0, sample_rate: float = SAMPLE_RATE) -> list[Fault]:
    """Return the faults of a text `NAME[:duration], ...`, as they begin at 0 s; raises `ParameterError`."""
    form = 'NAME[:duration], NAME ..., durations in s'
    parts = [part.strip() for part in text.split(',') if part.strip()]
    found = [_fault(part, _INJECTED, form, seed, sample_rate) for part in parts]
    for fault in found:
        if fault.kind.from_start:
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
        self._change = min((fault.first for fault in self._faults), default=math.inf)

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
        self.present = tuple(fault for fault in self._faults if fault.first <= time < fault.last)
        times = (moment for fault in self._faults for moment in (fault.first, fault.last))
        self._change = min((moment for moment in times if moment > time), default=math.inf)
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

    # What the faults change, in the order in which it is called in a sample.

    def reading(self, reading: Reading) -> Reading:
        """Return the sensors' reading."""
        return self._through('reading', reading)

    def counted(self, sample: int, microseconds: int) -> tuple[int, int]:
        """Return sample counter and clock of the electronics."""
        return self._through('counters', (sample, microseconds))

    def on_bus(self, frames: list[can.Message]) -> list[can.Message]:
        """Return the frames that the bus carries."""
        return self._through('frames', frames)

    def status(self, status: Status) -> Status:
        """Return the status that the electronics send."""
        return self._through('status', status)

    def driven(self, wanted: float) -> float:
        """Return the current (A) that the power stage drives for the current `wanted` (A)."""
        return self._through('current', wanted)

    def plant(self, plant: 'Plant') -> 'Plant':
        """Return the plant, sound as given, as it is with the faults."""
        return self._through('plant', plant)

    def _through(self, part: str, value: T) -> T:
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

    def _take(self, order: Fault | None, time: float) -> None:
        if order is None:
            self._faults = [fault for fault in self._faults if not fault.injected or fault.kind.for_good]
        else:
            order.begin, order.end, order.injected = time, time + order.end, True
            self._faults.append(order)


def _fault(text: str, pattern: re.Pattern[str], form: str, seed: int, sample_rate: float) -> Fault:
    found = pattern.fullmatch(text)
    if found is None:
        raise ParameterError(f'fault {text!r:.60} is not written as {form}')
    name = found['name']
    if name not in FAULTS:
        raise ParameterError(f'fault {name!r} is unknown; known are {", ".join(FAULTS)}')
    kind = FAULTS[name]
    begin = _time(text, found.groupdict().get('begin') or '0')
    duration = _time(text, found['duration']) if found['duration'] else kind.duration
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
