"""The electronics' end of the bus for tests: sends samples, reads setpoints."""

import threading
import time

from ros_testing import LIMIT, wait_until

from mount_driver.bus import open_bus
from mount_driver.can_library import can
from mount_driver.protocol import AliveCounter, Measurement, MountCodec, Setpoint, Status

CODEC = MountCodec()


def ripple(current: float) -> dict[str, float]:
    """Return both slopes of a coil of 45 mH that carries `current` (A) at 14 V, as the bus carries them."""
    volts = 14.0 - 2.5 * current
    return {'current_rate': round(volts / 0.045, 3), 'flux_rate': round(volts / 0.11808, 4)}


def sample(index: int, **changes) -> Measurement:
    """Return sample number `index`, taken at `index` ms."""
    values = {'displacement': 1e-6 * (index % 1000), 'coil_current': 0.0} | ripple(
        changes.get('coil_current', 0.0)
    )
    return Measurement(index % 65536, index * 1000 % 2**32, **(values | changes))


class FarEnd:
    """Sends measurements and collects setpoints."""

    def __init__(self, interface: str, channel: str, port: int):
        self.bus = open_bus(interface, channel, port=port, receive=(CODEC.setpoint.frame_id,))
        self._measurement_alive, self._status_alive = AliveCounter(), AliveCounter()
        self._streaming = threading.Event()
        self._thread: threading.Thread | None = None

    def send(self, measurement: Measurement, damage: int = 0) -> None:
        """Send a sample; `damage` is laid over its 13th byte."""
        data = CODEC.encode_measurement(measurement, self._measurement_alive.next())
        data[12] ^= damage
        self.send_raw(CODEC.measurement.frame_id, data)

    def send_status(self, status: Status) -> None:
        """Send a status."""
        self.send_raw(CODEC.status.frame_id, CODEC.encode_status(status, self._status_alive.next()))

    def send_raw(self, number: int, data: bytes | bytearray, **options) -> None:
        """Send any frame."""
        options = {'is_fd': True, 'is_extended_id': False} | options
        self.bus.send(can.Message(arbitration_id=number, data=data, **options))

    def setpoint(self) -> Setpoint:
        """Return the next setpoint that arrives."""
        message = self.bus.recv(LIMIT)
        assert message is not None, f'no setpoint frame within {LIMIT} s'
        return CODEC.setpoint.decode(message.data)[1]

    def setpoints(self) -> list[Setpoint]:
        """Return the setpoints that have come since the last call."""
        return [CODEC.setpoint.decode(each.data)[1] for each in iter(lambda: self.bus.recv(0.0), None)]

    def setpoint_where(self, condition) -> Setpoint:
        """Return the next setpoint that fulfils a condition."""
        return wait_until(lambda: found if condition(found := self.setpoint()) else None, 'such a setpoint')

    def stream(self, first: int = 0) -> None:
        """Send samples of a coil at 0 A, at about 1 kHz in a thread, and statuses at 10 Hz, until `close`."""

        def send_all():
            index, begin = first, time.monotonic()
            while not self._streaming.wait(max(0.0, begin + (index - first) * 1e-3 - time.monotonic())):
                self.send(sample(index))
                if index % 100 == 0:
                    self.send_status(Status(14.0, 20.0))
                index += 1

        self._thread = threading.Thread(target=send_all, daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End the stream and the bus."""
        self._streaming.set()
        if self._thread is not None:
            self._thread.join()
        self.bus.shutdown()
