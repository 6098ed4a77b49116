"""The lines on damping: one for each change, few for many."""

from mount_control.diagnosis import DampingLog


def test_each_change_is_a_line_and_off_tells_how_long_damping_lasted():
    log = DampingLog()
    assert log.look(False, 10.0) == ''
    assert log.look(True, 11.0) == 'damping on'
    assert log.look(True, 13.0) == ''
    assert log.look(False, 14.5) == 'damping off after 3.5 s'
    assert log.look(False, 99.0) == ''


def test_many_changes_within_a_second_are_one_line_at_its_end():
    log = DampingLog()
    assert log.look(True, 1.0) == 'damping on'
    said = [log.look(number % 2 == 0, 1.0 + 0.1 * number) for number in range(1, 10)]
    assert said == [''] * 9
    assert log.look(False, 2.05) == 'damping off, the last of 9 changes'


def test_a_change_back_within_a_second_is_told_too():
    log = DampingLog()
    log.look(True, 1.0)
    assert log.look(False, 1.5) == ''
    assert log.look(True, 1.6) == ''
    assert log.look(True, 2.0) == 'damping on, the last of 2 changes'
