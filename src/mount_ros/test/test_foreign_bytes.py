"""Whatever bytes come in as a message: numbers of the declared names, or a refusal in words."""

import contextlib

from hypothesis import example, given
from hypothesis import strategies as st
from ros_testing import mutated

from mount_ros.messages.event import read_change, read_mark
from mount_ros.messages.scalars import MessageError, ScalarsLayout, ScalarsReader, stamp_of
from mount_ros.topics import COIL_RIPPLE, DISPLACEMENT

SEEDS = st.integers(0, 1 << 62)
CHANGE = (
    "time: 12\nkind: parameter\ntext: 'mount_control: quality'\nnode: mount_control\nvalues: {quality: 0.7}\n"
)


@given(SEEDS, st.sampled_from([DISPLACEMENT, COIL_RIPPLE]))
@example(1_000_008_078, COIL_RIPPLE)  # cut within its positions, which the middleware takes
def test_a_mutated_message_is_read_or_refused(seed, topic):
    layout = ScalarsLayout(topic)
    count = len(topic.names)
    velocities = [0.25] * count if topic.has_derivatives else None
    sound = layout.pack(1_700_000_000_000_000_001, [0.5] * count, velocities)
    raw = mutated(bytes(sound), seed)
    with contextlib.suppress(MessageError):
        stamp, positions, _ = layout.unpack(raw)
        assert isinstance(stamp, int)
        assert len(positions) == count
    with contextlib.suppress(MessageError):
        assert len(ScalarsReader(topic.names).read(raw)[1]) == count
    with contextlib.suppress(MessageError):
        assert isinstance(stamp_of(raw), int)


@given(SEEDS)
def test_a_mutated_mark_keeps_its_words(seed):
    text = mutated(CHANGE.encode(), seed).decode(errors='surrogateescape')
    mark = read_mark(text, 7)
    assert isinstance(mark.time, int)
    assert isinstance(mark.text, str)
    change = read_change(text)
    assert change is None or isinstance(change.values, dict)
