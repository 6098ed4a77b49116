"""Which faults are there when: told before a run, or injected during it."""

import math
import re
from collections import deque
from collections.abc import Collection, Iterable
from typing import TypeVar

from mount_models.quantity import ParameterError
from mount_models.sampling import SAMPLE_RATE
from mount_sim.electronics.faults.kinds import FAULTS, Fault

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
        raise ParameterError(f'fault {name!r} is unknown; known are {", ".join(FAULTS)}')
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
