"""The exchange of frames with the electronics: one thread receives, another one watches the hold.

No ROS here: samples leave by a callback, setpoints come in by `send_setpoint` from any thread.
"""

import atexit
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import replace

from mount_driver.bus import CanLinkError, Frame, Reception, may_have_frames, open_bus
from mount_driver.can_library import can
from mount_driver.can_messages import Setpoint, table_crc
from mount_driver.clock import Clock
from mount_driver.link import Counts, Fault, Link, Refusal, Stamped
from mount_driver.parameters import DriverParameters
from mount_driver.protocol import AliveCounter, MountCodec
from mount_driver.watches.guard import Guard
from mount_driver.watches.heat_watch import HeatWatch
from mount_driver.watches.ripple_law import RippleLaw
from mount_models.sampling import sample_time_ns

_WAKE = 0.02  # s, chosen: longest sleep of the receiving thread when no frames come
_OFF_FRAMES = 3  # chosen: so that one lost frame does not leave the coil on until the electronics' own watch
_BUS_OFF = 0x40  # error class of a SocketCAN error frame, linux/can/error.h


class Exchange:
    """Owns the bus between `start` and `stop`; every way out of it sends 0 A first.

    Callbacks run in the receiving thread: `on_sample(stamped)` for every new sample as soon as it is decoded,
    because the setpoint waits for it; then the watches judge it, in any case before a setpoint that answers
    it leaves; then `on_judged(stamped)`. `on_temperature(stamp_ns, celsius)` is called for a status with a
    coil temperature, with the last sample's stamp; `on_own_setpoint(stamp_ns, current, loaded)` for one of
    the electronics' own law: whether they have loaded its table. A callback that hangs does not hold up the
    watch of the hold.
    `clock` gives the stamps and the time by which ages are judged; `steady() -> ns` is the steady clock.
    `heat` is the coil's temperature from before, which an activation does not cool; `law` is the ripple's.
    """

    def __init__(
        self,
        parameters: DriverParameters,
        codec: MountCodec,
        clock: Clock,
        on_sample: Callable[[Stamped], None],
        *,
        on_judged: Callable[[Stamped], None] = lambda stamped: None,
        on_temperature: Callable[[int, float], None] = lambda stamp, celsius: None,
        on_own_setpoint: Callable[[int, float, bool], None] = lambda stamp, current, loaded: None,
        steady: Callable[[], int] = time.monotonic_ns,
        heat: HeatWatch | None = None,
        law: RippleLaw | None = None,
    ):
        self.link = Link(codec, clock, sample_time_ns(parameters.sample_rate))
        self.reception = Reception()
        self.failure = ''
        """Why the exchange has ended on its own; empty while it runs."""
        self.bus_off = False
        self.unsent_reason = ''
        """Why the bus did not take the last setpoint frame of `Counts.unsent`."""
        self.last_received = 0
        """Steady clock at the last sound measurement frame, ns; 0 before the first."""
        self._parameters = parameters
        self._codec = codec
        self._on_sample = on_sample
        self._on_judged = on_judged
        self._on_temperature = on_temperature
        self._on_own_setpoint = on_own_setpoint
        self._table: Sequence[tuple[float, float]] = ()
        self._table_crc, self._point_alive = 0, AliveCounter()
        self._temperature_stamp: int | None = None  # of the last temperature that was handed on
        self._clock, self._lockstep = clock, clock.lockstep
        self._steady = steady
        heat = heat or HeatWatch(parameters.heating)
        self.guard = Guard(parameters, codec, clock, self.link, heat, law or RippleLaw())
        self._measurement_id = codec.measurement.frame_id
        self._bus: can.BusABC | None = None
        self._alive = 0  # counter of the next frame
        self._frame = Frame(codec.setpoint.frame_id, bytes(codec.setpoint.length))
        self._sending = threading.RLock()  # between setpoints, judgements, the watch and the end
        self._accepting = False
        self._ending = threading.Event()
        self._threads: list[threading.Thread] = []

    def counts(self) -> Counts:
        """Return what has been counted so far."""
        clock, unreadable = self._clock, self.reception.unreadable
        return replace(self.link.counts, restarts=clock.restarts, gaps=clock.gaps, unreadable=unreadable)

    def start(self, *, threaded: bool = True) -> None:
        """Open the bus and begin to receive, in threads or by `poll`; raises `CanLinkError`."""
        p, codec = self._parameters, self._codec
        messages = codec.measurement, codec.status, codec.setpoint, codec.own_setpoint
        receive = [message.frame_id for message in messages[: 4 if p.shadow else 3]]
        self._bus = open_bus(p.interface, p.channel, receive=receive, port=p.port)
        self._accepting = True
        atexit.register(self.stop)  # an exception that ends the process must not leave the coil on
        loops = {'can_receive': self._serve} if threaded else {}
        if threaded and not self._lockstep:  # where only frames move time, see `_receive`
            loops['can_watch'] = self._watch_hold
        self._threads = [threading.Thread(target=loops[name], name=name, daemon=True) for name in loops]
        for thread in self._threads:
            thread.start()

    def stop(self) -> None:
        """Send 0 A, end the threads, close the bus; safe to call twice.

        Whatever one step raises, the others are done. Raises `CanLinkError` where the bus did not take 0 A.
        """
        self._ending.set()
        with ExitStack() as steps:  # the last one first
            steps.callback(atexit.unregister, self.stop)
            steps.callback(self._close)
            for thread in self._threads:
                if thread is not threading.current_thread():
                    steps.callback(thread.join)
            steps.callback(self._leave_off)

    def send_setpoint(self, stamp: int, current: float) -> bool:
        """Send the current (A) that answers the sample of `stamp` (ns) at once; False if it was refused."""
        with self._sending:
            link = self.link
            if not self._accepting or self.bus_off:
                link.refuse(Refusal.BUS_LOST)
                return False
            guard = self.guard
            if guard.unjudged is not None and (fault := guard.judge_sample()) is not None:
                self.switch_off(fault)
            now = self._clock.now(0) if self._lockstep else self._steady()
            setpoint = link.answer(stamp, current, now, guard.limits)
            sent = setpoint is not None and self._send(setpoint)
            if link.double_answer and not link.fault:
                self._send(link.switch_off(Fault(link.double_answer, foreign_writer=True)))
                return False
            return sent

    def switch_off(self, fault: Fault | None) -> None:
        """Send 0 A and let no setpoint pass any more.

        The first fault stays, but for a graver one, or for one that names who answers beside the other.
        """
        if fault is None:
            return
        with self._sending:
            link = self.link
            graver = link.needs_initialisation and not fault.needs_initialisation
            if not link.fault or graver or link.nameless:
                self._send(link.switch_off(fault))

    def give_table(self, points: Sequence[tuple[float, float]]) -> None:
        """Let the electronics load the points (A, N) of the table of their law; none: forget it."""
        with self._sending:
            self._table, self._table_crc = points, table_crc(points)
            self._send_point(0)

    def poll(self) -> bool:
        """Handle the next frame if one is there and return whether; used without a thread."""
        bus = self._bus
        return bus is not None and may_have_frames(bus) and self._attempt(0.0)

    def watch(self) -> float:
        """Send 0 A if the sample that was answered last is too old for its current; return s until then."""
        with self._sending:
            now = self._now()
            if self.link.off_is_due(now):
                self._send(self.link.off())
            return 1e-9 * self.link.time_until_off(now)

    def _serve(self) -> None:
        while not self._ending.is_set() and not self.failure:
            self._attempt(_WAKE)

    def _watch_hold(self) -> None:
        """Look whenever 0 A may be due."""
        try:
            while not self._ending.wait(self.watch()):
                pass
        except BaseException as error:
            self._fail(error)

    def _attempt(self, wait: float) -> bool:
        """Handle the frame that comes within `wait` s; what is raised ends the exchange safely."""
        try:
            return self._receive(wait)
        except BaseException as error:
            self._fail(error)
        return False

    def _fail(self, error: BaseException) -> None:
        """End the exchange at 0 A with the reason: the border of its threads."""
        self.failure = _named(error)
        if isinstance(error, can.CanError):
            self.failure = f'CAN bus lost ({error}): activate mount_driver again when it is back'
        try:
            self._leave_off()
        except CanLinkError as unsent:
            self.failure += f'; {unsent}'
        if not isinstance(error, Exception):
            raise error

    def _receive(self, wait: float) -> bool:
        bus = self._bus
        if bus is None or self.failure:
            return False
        message = self.reception.frame(bus, wait)
        if message is not None:
            received = self._steady()
            if message.arbitration_id != self._measurement_id or message.is_error_frame:
                self._take_other(message)
            elif (stamped := self.link.take(message.data, received)) is None:
                self._take_unused(received)
            else:
                # The displacement leaves first, as its answer is waited for; no answer leaves unjudged.
                self.bus_off, self.last_received = False, received
                guard = self.guard
                guard.unjudged = stamped, stamped.stamp if self._lockstep else received
                self._on_sample(stamped)
                with self._sending:
                    if guard.unjudged is not None and (fault := guard.judge_sample()) is not None:
                        self.switch_off(fault)
                self._on_judged(stamped)
        if self._lockstep and self.link.latest is not None:  # else time has not begun
            self.watch()
        return message is not None

    def _take_unused(self, received: int) -> None:
        """Take a measurement frame that is no new sample."""
        self.switch_off(self.guard.judge_frame(received))
        latest = self.link.latest
        if self.link.resent and latest is not None:
            with self._sending:
                setpoint = self.link.answer_again(latest.sample.sample_counter, self._now())
                if setpoint is not None:
                    self._send(setpoint)

    def _take_other(self, message: can.Message) -> None:
        """Take a frame that is no measurement."""
        if message.is_error_frame:
            self.link.counts.error_frames += 1
            self.bus_off = self.bus_off or bool(message.arbitration_id & _BUS_OFF)
        elif message.arbitration_id == self._codec.status.frame_id:
            self._take_status(message)
        elif message.arbitration_id == self._codec.setpoint.frame_id:
            self._take_foreign_setpoint(message)
        elif message.arbitration_id == self._codec.own_setpoint.frame_id:
            self._take_own_setpoint(message)

    def _take_status(self, message: can.Message) -> None:
        status, latest = self.link.take_status(message.data), self.link.latest
        self.switch_off(self.guard.judge_status(status, self._now()))
        # The frame has no time of its own. A second one without a sample between has none at all.
        if status is not None and latest is not None and latest.stamp != self._temperature_stamp:
            celsius = status.coil_temperature_celsius
            if celsius == celsius:
                self._temperature_stamp = latest.stamp
                self._on_temperature(latest.stamp, celsius)

    def _take_foreign_setpoint(self, message: can.Message) -> None:
        layout = self._codec.setpoint
        if not layout.is_sound(message.data):
            return  # nor do the electronics use it, and their status reports it
        self.switch_off(self.guard.judge_foreign(layout.decode(message.data)[1]))
        # One frame with 0 A behind each of the other sender's keeps its sequence from being believed.
        with self._sending:
            self._send(self.link.off())

    def _take_own_setpoint(self, message: can.Message) -> None:
        taken = self.link.take_own(message.data)
        self.switch_off(self.guard.judge_own_setpoint(self._now()))
        if taken is not None:
            (stamp, own), count = taken, len(self._table)
            with self._sending:
                same = own.table_crc == self._table_crc
                if not same or own.next_point < count:
                    self._send_point(own.next_point if same else 0)
            self._on_own_setpoint(stamp, own.current, same and 0 < count <= own.next_point)

    def _now(self) -> int:
        return self._clock.now(self._steady())

    def _send(self, setpoint: Setpoint) -> bool:
        """Send one frame and return whether the bus took it; call it with the lock held."""
        bus = self._bus
        if bus is None or not self._accepting:
            return False
        try:
            self.guard.sent.append(setpoint)
            self._frame.data = self._codec.encode_setpoint(setpoint, self._alive)
            self._alive = (self._alive + 1) & 0xFF
            bus.send(self._frame)
        except Exception as error:
            return self._note_unsent(error)
        return True

    def _send_point(self, number: int) -> None:
        """Send a point of the table for the electronics' law; call it with the lock held."""
        if self._bus is None or not self._accepting:
            return
        layout, count = self._codec.table_point, len(self._table)
        point = self._table[number] if count else (0.0, 0.0)
        data = layout.pack((0, self._point_alive.next(), number, count, self._table_crc, *point))
        try:
            self._bus.send(Frame(layout.frame_id, data))
        except Exception as error:
            self._note_unsent(error)

    def _note_unsent(self, error: Exception) -> bool:
        # The adapters of python-can raise whatever they like; no frame behind this one may suffer.
        self.link.counts.unsent += 1
        self.unsent_reason = _named(error)
        return False

    def _leave_off(self) -> None:
        """Send 0 A and nothing more; raises `CanLinkError` where the bus did not take it."""
        taken: list[bool] = []
        with self._sending, ExitStack() as steps:  # what interrupts one frame must not keep back the others
            if not self._accepting:
                return
            steps.callback(setattr, self, '_accepting', False)  # the last step
            for _ in range(_OFF_FRAMES):
                steps.callback(lambda: taken.append(self._send(self.link.off())))
        if not all(taken):
            raise CanLinkError(
                f'{taken.count(False)} of {_OFF_FRAMES} frames with 0 A were not taken by the bus '
                f'({self.unsent_reason}); the electronics go to 0 A by their own watch'
            )

    def _close(self) -> None:
        bus, self._bus = self._bus, None
        if bus is not None:
            bus.shutdown()


def _named(error: BaseException) -> str:
    return f'{type(error).__name__}: {error}'
