"""The driver's node: CAN on one side, topics on the other."""

import time
from math import nan

from mount_driver.clock import CounterClock, ElectronicsClock
from mount_driver.engine_speed import EngineSpeedReader, SpeedSignal
from mount_driver.exchange import Exchange
from mount_driver.health import Health
from mount_driver.link import Fault, Refusal, Stamped
from mount_driver.parameters import DriverParameters
from mount_driver.protocol import MountCodec
from mount_driver.watches.heat_watch import HeatWatch
from mount_driver.watches.ripple_law import RippleLaw, ripple_law
from mount_models.coil.copper import check_heating
from mount_models.sampling import sample_time_ns
from mount_models.specimen_choice import SpecimenChoice
from mount_ros.messages.cdr import temperature
from mount_ros.messages.force_table import law_table_points
from mount_ros.messages.scalars import MessageError, OneNumberLayout, ScalarsLayout
from mount_ros.nodes.diagnostics import Verdict
from mount_ros.nodes.lifecycle import SafeLifecycleNode
from mount_ros.nodes.parameters import SpecimenValues, declare, read
from mount_ros.nodes.process import run_node
from mount_ros.nodes.real_time import RealTimeThreads
from mount_ros.topics import (
    COIL_RIPPLE,
    COIL_TEMPERATURE,
    CURRENT_SETPOINT,
    DISPLACEMENT,
    ELECTRONICS_SETPOINT,
    ELECTRONICS_TABLE,
    ENGINE_SPEED,
)

_BREAK = 1.1  # s, chosen: after such a hole in the stamps mount_control refuses the table of before


class MountDriver(SafeLifecycleNode):
    """Publishes what the electronics measure, sends `current_setpoint`; away from active: 0 A."""

    real_time_threads = RealTimeThreads(frozenset({'data', 'can_receive', 'can_watch'}))

    def __init__(self, **arguments):
        super().__init__('mount_driver', **arguments)
        declare(self, DriverParameters())
        declare(self, SpecimenChoice())
        self._of_specimen = SpecimenValues(self)
        self._exchange: Exchange | None = None
        self._speed: EngineSpeedReader | None = None
        self._heat: HeatWatch | None = None
        self._not_before = 0.0  # s, steady clock: end of the break that a fault of the coil demands
        self._displacement_layout = ScalarsLayout(DISPLACEMENT)
        self._ripple_layout = ScalarsLayout(COIL_RIPPLE)
        self._temperature_layout = OneNumberLayout(temperature)
        self._speed_layout = ScalarsLayout(ENGINE_SPEED)
        self._setpoint_layout = ScalarsLayout(CURRENT_SETPOINT)
        self._own_layout = ScalarsLayout(ELECTRONICS_SETPOINT)

    def configure(self) -> None:
        self._take_specimen()
        self._settings = read(self, DriverParameters())
        sample_time_ns(self._settings.sample_rate)  # refuses what the electronics cannot count
        check_heating(self._settings.heating)
        self._heat = self._heat_of(self._settings)
        self._codec = MountCodec()
        self._speed_signal = SpeedSignal(speed) if (speed := self._settings.engine_speed).dbc else None
        path = self.open_data_path()
        self._publish_displacement = path.sender(DISPLACEMENT)
        self._publish_ripple = path.sender(COIL_RIPPLE)
        self._publish_temperature = path.sender(COIL_TEMPERATURE)
        if self._speed_signal:  # else another node may publish it
            self._publish_speed = path.sender(ENGINE_SPEED)
        path.subscribe(CURRENT_SETPOINT, self._on_setpoint, directly=True)
        self._law_table: list[tuple[float, float]] = []
        self._law_table_loaded = False
        if self._settings.shadow:
            self._publish_own_setpoint = path.sender(ELECTRONICS_SETPOINT)
            path.subscribe(ELECTRONICS_TABLE, self._on_law_table)
        path.start()
        self._path = path

    def activate(self) -> None:
        self.ending.wait(max(0.0, self._not_before - time.monotonic()))
        self.data_path.publisher_watch.wait_for_sole(self.ending)
        # ROS time is tied to the steady clock here, once: later steps of the system's clock move nothing.
        epoch_offset = time.time_ns() - time.monotonic_ns()
        period = sample_time_ns(self._settings.sample_rate)
        clock = CounterClock(period) if self.lockstep else ElectronicsClock(epoch_offset, period)
        exchange = Exchange(
            self._settings,
            self._codec,
            clock,
            self._on_sample,
            on_judged=self._on_judged,
            on_temperature=self._on_temperature,
            on_own_setpoint=self._on_own_setpoint,
            heat=self._heat,
            law=self._law,
        )
        exchange.give_table(self._law_table)
        started = time.monotonic_ns()
        # In lock-step on a bus within this process, frames only come while the data thread is free.
        attended = self.lockstep and self._settings.interface == 'virtual'
        exchange.start(threaded=not attended)
        self._exchange = exchange
        if self._speed_signal:
            offset = 0 if self.lockstep else epoch_offset
            self._speed = EngineSpeedReader(
                self._speed_signal,
                self._speed_bus(),
                self._on_engine_speed,
                lambda received: clock.now(received) + offset,
            )
            self._speed.start(threaded=not attended)
        self._health = Health(exchange, self._settings, started, lockstep=self.lockstep, speed=self._speed)
        self.data_path.publisher_watch.report()
        if attended:
            self._path.add_poll(self._poll)

    def deactivate(self) -> None:
        exchange, self._exchange = self._exchange, None
        if exchange is not None:
            try:
                self._path.remove_polls()
            finally:
                exchange.stop()
                if self._speed is not None:
                    self._speed.stop()
                    self._speed = None
                if exchange.link.fault:
                    self._not_before = time.monotonic() + _BREAK

    def on_publisher_conflict(self, confirmed: str, suspected: str) -> None:
        exchange = self._exchange
        if exchange is not None:
            exchange.guard.writer_doubt = suspected
            exchange.switch_off(Fault(confirmed, foreign_writer=True) if confirmed else None)

    def judge(self) -> Verdict:
        return self._health.judge(time.monotonic_ns())

    def _speed_bus(self) -> tuple[str, str, int]:
        own, speed = self._settings, self._settings.engine_speed
        return speed.interface or own.interface, speed.channel or own.channel, own.port

    def _poll(self) -> bool:
        """Take what has come; the speed of the engine behind the sample that it came with."""
        exchange, speed = self._exchange, self._speed
        busy = exchange is not None and exchange.poll()
        if exchange is not None and speed is not None:
            while exchange.poll():
                busy = True
            busy |= speed.poll()
        return busy

    def _heat_of(self, settings: DriverParameters) -> HeatWatch:
        """Return what is known of the coil: a new configuration does not cool it."""
        before = self._heat
        if before is None:
            return HeatWatch(settings.heating, settings.coil_celsius_before)
        if before.heating == settings.heating:
            return before
        return HeatWatch(settings.heating, before.celsius if before.known else nan)

    def _take_specimen(self) -> None:
        self._law = RippleLaw()
        file = str(self.get_parameter('parameters_file').value)
        if not file:
            return  # the defaults are the shipped specimen's, and its other parts take a second to load
        from mount_models.specimen import chosen_specimen

        specimen = chosen_specimen(file, str(self.get_parameter('specimen').value))
        self._law = ripple_law(specimen)
        self._of_specimen.give(DriverParameters().heating, 'heating', specimen.heating._asdict())

    def _on_sample(self, stamped: Stamped) -> None:
        stamp, sample = stamped
        self._publish_displacement(self._displacement_layout.pack(stamp, (sample.displacement,)))

    def _on_judged(self, stamped: Stamped) -> None:
        stamp, sample = stamped
        slopes = sample.current_rate, sample.flux_rate
        self._publish_ripple(self._ripple_layout.pack(stamp, (sample.coil_current, nan), slopes))

    def _on_temperature(self, stamp: int, celsius: float) -> None:
        self._publish_temperature(self._temperature_layout.pack(stamp, celsius))

    def _on_engine_speed(self, stamp: int, velocity: float) -> None:
        self._publish_speed(self._speed_layout.pack(stamp, (nan,), (velocity,)))

    def _on_own_setpoint(self, stamp: int, current: float, loaded: bool) -> None:
        if current == current or loaded != self._law_table_loaded:
            self._law_table_loaded = loaded
            self._publish_own_setpoint(self._own_layout.pack(stamp, (current, loaded)))

    def _on_law_table(self, raw: bytes) -> None:
        self._law_table = law_table_points(raw)
        if self._exchange is not None:
            self._exchange.give_table(self._law_table)

    def _on_setpoint(self, raw: bytes) -> None:
        exchange = self._exchange
        if exchange is None:
            return
        try:
            stamp, (current,), _ = self._setpoint_layout.unpack(raw)
        except MessageError:
            exchange.link.refuse(Refusal.MALFORMED)
            return
        exchange.send_setpoint(stamp, current)


def main() -> None:
    """Run the driver's process."""
    run_node(MountDriver)


if __name__ == '__main__':
    main()
