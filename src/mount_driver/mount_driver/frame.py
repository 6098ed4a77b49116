"""The CAN FD frames of `mount.dbc`, as both ends of the bus send them."""

from typing import Any

from mount_driver.can_library import can


class Frame(can.Message):
    """A standard CAN FD frame with bit rate switching, cheap to copy.

    python-can's virtual bus makes a deep copy of each frame that it carries, which for its own class takes
    eight times as long as copying the bytes.
    """

    __slots__ = ()

    def __init__(self, identifier: int, data: bytes | bytearray):
        super().__init__(
            arbitration_id=identifier, data=data, is_extended_id=False, is_fd=True, bitrate_switch=True
        )

    def __deepcopy__(self, _: Any) -> can.Message:
        copied = self.__copy__()
        copied.data = bytearray(self.data)
        return copied
