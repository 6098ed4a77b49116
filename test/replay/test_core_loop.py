"""Many samples in one compiled call give the messages of samples taken one by one, byte for byte."""

import numpy as np
import pytest

from engine_mount.drives.loop.run import run_core
from mount_control.control_loop import ControlLoop
from mount_ros import topics
from mount_ros.messages.scalars import ScalarsLayout, stamp_of

MOTION = {'scenario': 'bench', 'timeline.start': 2.8, 'timeline.duration': 1.5, 'bench.amplitude': 0.0015}
NARROW = 0.0010  # m
CASES = {
    'nothing doubtful': ({}, {}),
    'single samples out of range': (
        {'electronics.displacement_noise': 3e-4},
        {'displacement_range': 0.0018, 'displacement_noise': 0.01, 'displacement_velocity': 100.0},
    ),
    'a noise that is not believed': ({'electronics.displacement_noise': 3e-4}, {}),
    'longer than is bridged': ({'bench.frequency': 3.0}, {'displacement_range': NARROW}),
    'an excitation on the chassis': ({'scenario': 'motorway'}, {}),
    'an engine that sends its speed': (
        {'scenario': 'motorway', 'idle.amplitude': 60.0, 'idle.speed_sent': True},
        {},
    ),
}


def messages_of(case):
    sim, control = CASES[case]
    found = []
    outcome = run_core(
        {'mount_sim': {**MOTION, **sim}, 'mount_control': control},
        lambda topic, raw, stamp: found.append((topic.name, raw, stamp)),
    )
    return outcome, found


@pytest.mark.parametrize('case', CASES)
def test_many_samples_at_once_are_those_taken_one_by_one(case, monkeypatch):
    _, at_once = messages_of(case)
    monkeypatch.setattr(ControlLoop, 'expects', lambda self, stamp: False)
    _, one_by_one = messages_of(case)
    assert at_once == one_by_one


def test_only_a_step_of_the_controller_leaves_a_trace():
    _, found = messages_of('longer than is bridged')
    displacement = ScalarsLayout(topics.DISPLACEMENT)
    result = next(stamp for name, _, stamp in found if name == topics.AIR_GAP.name)
    values = {
        stamp: displacement.unpack(raw)[1][0] for name, raw, stamp in found if name == displacement.topic.name
    }
    believable = [stamp for stamp, value in values.items() if stamp > result and abs(value) <= NARROW]
    traced = [stamp for name, _, stamp in found if name == topics.CONTROL_TRACE.name]
    assert traced == believable
    assert len(believable) < sum(stamp > result for stamp in values)


def test_columns_hold_the_messages_that_come_one_by_one():
    order = {'mount_sim': {**MOTION, 'timeline.duration': 0.3}}
    one_by_one, in_columns, rest = [], [], []

    def write_columns(columns, stamps):
        for _, rows in columns:
            assert [stamp_of(row.tobytes()) for row in rows] == stamps.tolist()
        in_columns.append(np.hstack([rows for _, rows in columns]).tobytes())

    run_core(order, lambda topic, raw, stamp: one_by_one.append((topic.name, raw, stamp)))
    run_core(order, lambda *message: rest.append(message), write_columns=write_columns)
    temperatures = [stamp for topic, _, stamp in rest if topic is topics.COIL_TEMPERATURE]
    assert temperatures == [100_000_000 * k for k in range(31)]  # 10 Hz in 3.1 s
    results = [topic.name for topic, _, _ in rest if topic is not topics.COIL_TEMPERATURE]
    assert results[:2] == ['air_gap', 'current_force_table']
    assert results[2:] in ([], ['current_setpoint'])  # 0 A of a controller that is switched off
    apart = {(topic.name, raw, stamp) for topic, raw, stamp in rest}
    assert b''.join(in_columns) == b''.join(message[1] for message in one_by_one if message not in apart)
