"""The engine's speed from a message on the vehicle's bus, by a signal of the user's own DBC.

It only listens: no frame leaves on that bus. What goes wrong here is a sentence and costs the mount nothing.
"""

import threading
import time
from collections.abc import Callable, Sequence
from math import nan, pi
from pathlib import Path
from typing import Annotated, Any, NamedTuple

from mount_driver.bus import CanLinkError, Reception, may_have_frames, open_bus
from mount_driver.can_library import Database, can, cantools
from mount_models.quantity import ParameterError, Quantity, nearest

RADIANS = {'rpm': 2.0 * pi / 60.0, '1/min': 2.0 * pi / 60.0, 'Hz': 2.0 * pi, 'rad/s': 1.0}
"""rad/s in one of each unit of a signal."""
_WAKE = 0.1  # s, chosen: longest wait for a frame
_AGAIN = 1.0  # s, chosen: from a bus that is lost to the next attempt
_SILENCE = 1_000_000_000  # ns, chosen: a message of 10 Hz that has not come for so long does no more


class EngineSpeedParameters(NamedTuple):
    """Where the speed of the engine is found."""

    interface: Annotated[
        str, Quantity('name', "CAN interface of the vehicle; empty: the mount's own bus")
    ] = ''
    channel: Annotated[str, Quantity('name', "its channel; empty: that of the mount's own bus")] = ''
    dbc: Annotated[
        str, Quantity('path', 'DBC of the vehicle; empty: the speed of the engine is not read')
    ] = ''
    message: Annotated[str, Quantity('name', 'message in the DBC that carries the speed')] = ''
    signal: Annotated[str, Quantity('name', f'its signal, in one of {", ".join(RADIANS)}')] = ''


class SpeedSignal:
    """One signal of a DBC; raises `ParameterError` where it is not there or has no unit of a speed."""

    def __init__(self, parameters: EngineSpeedParameters):
        try:
            database = cantools.database.load_string(
                Path(parameters.dbc).read_text('cp1252'), 'dbc', strict=False
            )
        except (OSError, ValueError, cantools.database.Error) as error:
            raise ParameterError(
                f'engine_speed.dbc: {parameters.dbc} is not readable ({error}); name a DBC, or leave it empty'
            ) from None
        assert isinstance(database, Database)
        self.message = _named('message', parameters.message, database.messages, parameters.dbc)
        self.signal = _named('signal', parameters.signal, self.message.signals, self.message.name)
        if self.signal.unit not in RADIANS:
            raise ParameterError(
                f'engine_speed.signal: {parameters.signal} has the unit {self.signal.unit!r} in '
                f'{parameters.dbc}; must be one of {", ".join(RADIANS)}: correct the DBC'
            )

    def carried_by(self, frame: can.Message) -> bool:
        """Return whether a frame is the message."""
        return (
            frame.arbitration_id == self.message.frame_id
            and frame.is_extended_id == self.message.is_extended_frame
            and not (frame.is_error_frame or frame.is_remote_frame)
        )

    def velocity(self, data: bytes | bytearray) -> float | None:
        """Return the speed (rad/s), NaN where it is not known; None where these data do not carry it."""
        try:
            values = self.message.decode(data, decode_choices=False)
            value = float(values[self.signal.name])
        except (KeyError, ValueError, TypeError, cantools.database.Error):
            # Another of several multiplexed contents, or too short a frame.
            return None if self.message.is_multiplexed() else nan
        low, high = self.signal.minimum, self.signal.maximum
        known = (low is None or value >= low) and (high is None or value <= high)
        return value * RADIANS[self.signal.unit] if known else nan


def _named(kind: str, name: str, among: Sequence[Any], owner: str) -> Any:
    """Return the one of this name, or raise `ParameterError` with the nearest ones."""
    known = {each.name: each for each in among}
    if name not in known:
        raise ParameterError(f'engine_speed.{kind}: {name!r} is no {kind} of {owner}; {nearest(name, known)}')
    return known[name]


class EngineSpeedReader:
    """Reads the speed from its own connection to the bus between `start` and `stop`.

    `publish(stamp, velocity)` takes ns by `stamp_at(monotonic ns)` of the reception, and rad/s.
    """

    def __init__(
        self,
        signal: SpeedSignal,
        bus: tuple[str, str, int],
        publish: Callable[[int, float], None],
        stamp_at: Callable[[int], int],
    ):
        """`bus` are interface, channel, and port of UDP multicast."""
        self._signal, self._where, self._publish, self._stamp_at = signal, bus, publish, stamp_at
        self._bus: can.BusABC | None = None
        self._reception = Reception()
        self._ending = threading.Event()
        self._thread: threading.Thread | None = None
        self._failure = ''
        self._received = time.monotonic_ns()

    def start(self, *, threaded: bool) -> None:
        """Begin to listen, in a thread or by `poll`."""
        if threaded:
            self._thread = threading.Thread(target=self._serve, name='can_speed', daemon=True)
            self._thread.start()
        else:
            self._open()

    def stop(self) -> None:
        """End the thread and close the bus; safe to call twice."""
        self._ending.set()
        if self._thread is not None:
            self._thread.join()
        self._close()

    def poll(self) -> bool:
        """Take what frames are there and return whether there were any; used without a thread."""
        busy = False
        while self._bus is not None and may_have_frames(self._bus):
            self._take(self._bus, 0.0)
            busy = True
        return busy

    def trouble(self, now: int) -> str:
        """Return what is wrong at `now` (steady clock, ns), '' where nothing is."""
        interface, channel, _ = self._where
        if self._failure:
            return f'engine_speed is not read: {self._failure}'
        if now - self._received > _SILENCE:
            return (
                f'engine_speed: no {self._signal.message.name} on {interface} {channel} for more than '
                f'{1e-9 * _SILENCE:g} s; is the vehicle awake, is engine_speed.channel right?'
            )
        return ''

    def _serve(self) -> None:
        while not self._ending.is_set():
            self._open()
            try:
                while self._bus is not None and not self._ending.is_set():
                    self._take(self._bus, _WAKE)
            except Exception as error:  # the border of the thread: whatever an adapter raises
                self._failure = f'{type(error).__name__}: {error}'
            self._close()
            self._ending.wait(_AGAIN)

    def _open(self) -> None:
        interface, channel, port = self._where
        message = self._signal.message
        try:
            self._bus = open_bus(
                interface, channel, receive=[message.frame_id], port=port, extended=message.is_extended_frame,
                any_rate=True,
            )  # fmt: skip
            self._failure = ''
        except CanLinkError as error:
            self._failure = str(error)

    def _close(self) -> None:
        bus, self._bus = self._bus, None
        if bus is not None:
            bus.shutdown()

    def _take(self, bus: can.BusABC, wait: float) -> None:
        frame = self._reception.frame(bus, wait)
        received = time.monotonic_ns()
        if frame is not None and self._signal.carried_by(frame):
            velocity = self._signal.velocity(frame.data)
            if velocity is not None:
                self._received = received
                self._publish(self._stamp_at(received), velocity)
