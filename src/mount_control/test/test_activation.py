"""The table of an activation belongs to the measurements that come now, or is refused."""

import random
import re

import pytest

from mount_control.activation import check_belongs, check_rate
from mount_control.control_loop import ControlLoop
from mount_control.force_maker import ForceTableError

MS, S = 1_000_000, 1_000_000_000  # ns


def stream(*stamps):
    loop = ControlLoop()
    for stamp in stamps:
        loop.note(stamp)
    return loop


@pytest.mark.parametrize(
    ('table', 'air_gap', 'seconds', 'reason'),
    [
        (4, 4, (3, 4, 5), ''),
        (3, 3, (3,), ''),
        (None, 1, (1,), 'no current_force_table was received (0 messages, needed is 1); activate mount_init'),
        (1, None, (1,), 'no air_gap was received (0 messages, needed is 1); activate mount_init (again)'),
        (None, None, (1,), 'no current_force_table'),
        (1, 1, (), 'no displacement was received; activate mount_driver first'),
        (4, 3, (1, 2, 3, 4), '(activation 4.000 s) and air_gap (activation 3.000 s) are of different'),
        (2, 2, (1, 2, 4, 5), 'is of 2.000 s, but mount_control has received the measurements without a break '
            'within 4.000 s .. 5.000 s only; activate mount_init (again)'),
        (2, 2, (4, 5), 'within 4.000 s .. 5.000 s only'),  # it was configured later
        (101, 101, (100, 101, 5, 6), 'within 5.000 s .. 6.000 s only'),  # the time went back
    ],
)  # fmt: skip
def test_a_table_that_may_be_of_other_measurements_is_refused(table, air_gap, seconds, reason):
    stamps = [None if at is None else at * S for at in (table, air_gap)]
    if not reason:
        check_belongs(stream(*(at * S for at in seconds)), *stamps)
        return
    with pytest.raises(ForceTableError, match=re.escape(reason)):
        check_belongs(stream(*(at * S for at in seconds)), *stamps)


def test_a_repeated_or_overtaken_sample_is_no_break():
    loop = stream(10 * S, 10 * S + 2 * MS, 10 * S + MS, 10 * S + MS)
    assert (loop.first, loop.last) == (10 * S, 10 * S + 2 * MS)
    assert stream(S, 2 * S).first == S  # nor is a second of silence
    assert stream(S, 2 * S + 1).first == 2 * S + 1


@pytest.mark.parametrize(
    ('period', 'kept', 'sound', 'wrong'),
    [(0.5, 1.0, 2000.0, 1000.0), (1.0, 0.4, 1000.0, 2000.0)],  # the latter on an overloaded machine
)
def test_a_controller_made_for_another_rate_is_not_activated(period, kept, sound, wrong):
    numbers = random.Random(1)
    loop = stream(*(S + round(k * period * MS) for k in range(400) if numbers.random() < kept))
    check_rate(loop, sound)
    with pytest.raises(
        ForceTableError, match=f'at {sound:.0f} Hz, but sample_rate of mount_control is {wrong:.0f}'
    ):
        check_rate(loop, wrong)
