"""The current-force table survives its message, and everything that is no table is refused."""

import numpy as np
import pytest

from mount_ros.messages.cdr import deserialise
from mount_ros.messages.force_table import from_bytes, from_message, table_message
from mount_ros.messages.scalars import MessageError
from mount_ros.topics import CURRENT_FORCE_TABLE

STAMP = 1_700_000_000_123_456_789
TABLE = np.array([[0.4725, 0.8, 1.6, 3.0], [0.0, 40.0, 200.0, 304.0]])


def to_message(stamp, table):
    return deserialise(table_message(stamp, table), CURRENT_FORCE_TABLE.type)


def test_table_and_activation_survive_serialisation():
    received = from_bytes(table_message(STAMP, TABLE))
    assert received.stamp == STAMP
    assert np.array_equal([received.current, received.normal_force], TABLE)


@pytest.mark.parametrize(
    ('table', 'sentence'),
    [
        (np.ones(4), 'shape'),
        (np.ones((3, 4)), 'shape'),
        (TABLE[:, :1], 'shape'),
        ([[0.1, np.nan], [0.0, 1.0]], 'finite; column 1'),
        ([[0.1, 0.2], [0.0, np.inf]], 'finite; column 1'),
        ([[0.1, 0.3, 0.3], [0.0, 1.0, 2.0]], 'current at columns 1 and 2 is 0.3 and 0.3 A'),
        ([[0.1, 0.2, 0.3], [0.0, 2.0, 1.0]], 'normal force at columns 1 and 2 is 2 and 1 N'),
        ([[-0.1, 0.2], [0.0, 1.0]], 'within 0 .. 3 A; it spans -0.1 .. 0.2'),
        ([[0.1, 3.001], [0.0, 1.0]], 'within 0 .. 3 A; it spans 0.1 .. 3.001'),
    ],
)
def test_what_is_no_table_is_neither_sent_nor_read(table, sentence):
    with pytest.raises(MessageError, match=sentence):
        to_message(STAMP, table)
    rows = np.asarray(table, float)
    if rows.ndim == 2 and rows.shape[0] == 2:
        message = to_message(STAMP, TABLE)
        message.data = rows.ravel().tolist()
        message.layout.dim[0].stride = rows.size
        message.layout.dim[1].size = message.layout.dim[1].stride = rows.shape[1]
        with pytest.raises(MessageError, match=sentence):
            from_message(message)


@pytest.mark.parametrize(
    'spoil',
    [
        lambda message: message.layout.dim.pop(),
        lambda message: message.layout.dim.clear(),
        lambda message: message.data.pop(),
        lambda message: setattr(message.layout, 'data_offset', 1),
        lambda message: setattr(message.layout.dim[0], 'label', 'normal_force, current'),
        lambda message: setattr(message.layout.dim[1], 'size', 8),
        *(
            lambda message, label=label: setattr(message.layout.dim[1], 'label', label)
            for label in ('', 'activation', 'activation soon', 'activation -4', '12')
        ),
    ],
)
def test_a_message_of_another_layout_is_refused(spoil):
    message = to_message(STAMP, TABLE)
    spoil(message)
    with pytest.raises(MessageError, match=r'must hold 2 x N numbers as .*; activate mount_init again'):
        from_message(message)
