"""What may differ without being a difference: nothing, unless it is said."""

import difflib
import re
from collections.abc import Collection, Iterable
from dataclasses import dataclass

SWITCHING = 'switching'
_ALL = ''
_FORM = re.compile(r'(?:(?P<name>[^=\s]+)=)?(?P<value>[0-9.]+(?:[eE][-+]?\d+)?)(?P<percent>%?)')


class ToleranceError(ValueError):
    """A tolerance is not understood or names no signal; the text says how to write it."""


@dataclass(frozen=True)
class Tolerance:
    """A bound on the difference: in the signal's unit, or as a share of its largest value in A."""

    value: float = 0.0
    relative: bool = False

    def bound(self, largest: float) -> float:
        """Return the bound in the unit of the signal, whose largest absolute value is `largest`."""
        return self.value * largest if self.relative else self.value


EXACT = Tolerance()


class Tolerances:
    """The tolerances of a comparison by signal, topic, or for all signals."""

    def __init__(self, texts: Iterable[str] = ()):
        """Read `NAME=0.01`, `NAME=1%` or, for all signals, `1%`; raises `ToleranceError`.

        NAME is a signal (`current`), a topic (`current_setpoint`), both (`control_trace.current`), the same
        of one mount (`mount_left/control_trace.current`), or `switching` for the times of switching in s.
        """
        self._by_name = dict(map(_read, texts))

    def of(self, mount: str, topic: str, signal: str) -> Tolerance:
        """Return the tolerance of a signal; the name that says most counts.

        `mount` is what stands before the topic: `mount_left/`, or nothing.
        """
        for name in (f'{mount}{topic}.{signal}', f'{topic}.{signal}', signal, mount + topic, topic, _ALL):
            if name in self._by_name:
                return self._by_name[name]
        return EXACT

    @property
    def switching(self) -> float:
        """By how much a switching may move, s."""
        return self._by_name.get(SWITCHING, EXACT).value

    def check(self, known: Collection[tuple[str, str, str]]) -> None:
        """Raise `ToleranceError` for a name that is none of `known` (mount, topic, signal)."""
        topics = {name for mount, topic, _ in known for name in (topic, mount + topic)}
        signals = {signal for _, _, signal in known}
        both = {f'{name}.{signal}' for mount, topic, signal in known for name in (topic, mount + topic)}
        names = topics | signals | both | {SWITCHING, _ALL}
        for name in self._by_name:
            if name not in names:
                near = difflib.get_close_matches(name, names - {_ALL}, n=3)
                hint = f'did you mean {" or ".join(near)}?' if near else '--json lists all signals'
                raise ToleranceError(f'tolerance for {name!r}: no such signal in both recordings; {hint}')


def _read(text: str) -> tuple[str, Tolerance]:
    match = _FORM.fullmatch(text.strip())
    try:
        value = float(match['value']) if match else 0.0
    except ValueError:
        match = None
    if match is None:
        raise ToleranceError(f'tolerance {text!r}: write NAME=VALUE as current=0.01, or NAME=1%, or 1%')
    name, relative = match['name'] or _ALL, bool(match['percent'])
    if name == _ALL and not relative:
        raise ToleranceError(
            f'tolerance {text!r} would mean another thing in each unit; name a signal or write a share: 1%'
        )
    if name == SWITCHING and relative:
        raise ToleranceError('the tolerance of switching is a time in s, such as switching=0.002')
    return name, Tolerance(value / 100.0 if relative else value, relative)
