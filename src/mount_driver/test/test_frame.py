from copy import deepcopy

from mount_driver.bus import Frame


def test_a_deep_copy_is_equal_and_shares_nothing():
    frame = Frame(0x123, bytearray(range(24)))
    frame.timestamp = 5.0
    copied = deepcopy(frame)
    assert copied.equals(frame, timestamp_delta=0.0)
    frame.data[0] = 99
    assert copied.data == bytearray(range(24))


def test_a_frame_is_standard_fd_with_bit_rate_switching():
    frame = Frame(0x123, bytes(8))
    assert (frame.arbitration_id, frame.is_extended_id, frame.is_fd, frame.bitrate_switch) == (
        0x123,
        False,
        True,
        True,
    )
