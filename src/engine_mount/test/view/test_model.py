"""From messages to what is shown: extents that hold every sample, state, and what stands beside."""

import pytest

import engine_mount
from engine_mount.view.feed import Message, RecordedFeed
from engine_mount.view.model import BESIDE, Model
from mount_ros.messages.scalars import ScalarsLayout
from mount_ros.topics import DISPLACEMENT, EVENT


def messages_of(drive):
    """Return all messages of a recording in the order of their arrival."""
    feed = RecordedFeed(drive, rate=1000.0)
    return feed, [feed.message(number) for number in range(len(feed))]


@pytest.fixture(scope='module')
def shown(drive):
    """Return the model behind the whole drive, in intervals of 250 messages."""
    feed, messages = messages_of(drive)
    beside = []
    model = Model(feed, receivers=[beside.append])
    for begin in range(0, len(messages), 250):
        model.interval(messages[begin : begin + 250])
    model.beside = ScalarsLayout(BESIDE), beside
    return model


def highest(model, key):
    return max(interval.extents[key][1] for interval in model.intervals if key in interval.extents)


def test_no_peak_is_lost_between_the_intervals(drive, shown):
    recorded = engine_mount.open(drive)
    peak = 1e3 * recorded['displacement']['mount'].max()
    assert highest(shown, 'displacement') == pytest.approx(peak)
    assert highest(shown, 'setpoint') == pytest.approx(3.0)


def test_time_is_that_of_the_recording(drive, shown):
    assert Model(RecordedFeed(drive, begin=5.0), beside=False).state.zero == shown.state.zero
    times = [interval.time for interval in shown.intervals]
    assert times == sorted(times)
    assert times[-1] == pytest.approx(6.999, abs=0.001)


def test_a_mount_without_current_swings_further_than_the_one_that_is_driven(shown):
    assert highest(shown, 'beside.no current') > 1.2 * highest(shown, 'displacement')
    assert 0.0 < highest(shown, 'beside.hydromount') < highest(shown, 'beside.no current')
    dashes = {curve['name']: curve['dash'] for curve in shown.chart()['panels'][0]['curves']}
    assert list(dashes.items()) == [
        ('hydromount', 'dashed'),
        ('no current', 'dotted'),
        ('this mount', 'solid'),
    ]
    layout, messages = shown.beside
    moved = [layout.unpack(message.raw)[1][0] for message in messages]
    assert 1e3 * max(moved) == highest(shown, 'beside.hydromount')


def test_a_hydromount_has_its_own_name_and_no_current(drive):
    model = Model(messages_of(drive)[0])
    model.state.parameters = {'mount_sim': {'mount': 'hydro'}}
    panels = {
        panel['label']: [curve['name'] for curve in panel['curves']] for panel in model.chart()['panels']
    }
    assert panels == {'displacement (mm)': ['hydromount'], 'latency (ms)': ['sample to setpoint']}


def test_gap_levels_motion_and_damping_are_told(shown):
    assert shown.state_json()['events'][-1]['text'] == 'on'
    values = {entry['name']: entry['value'] for entry in shown.state_json()['values']}
    assert values['contact gap'].startswith('349.')
    assert values['no current: peak, rms'] > values['this mount: peak, rms']
    levels = shown.chart()['panels'][0]['levels']
    assert [level['name'] for level in levels] == ['damping half engaged, 0.1 mm']


def test_a_malformed_message_is_no_end(drive):
    feed, _ = messages_of(drive)
    model = Model(feed, beside=False)
    interval = model.interval([Message(DISPLACEMENT, b'\0' * 40, 5, 5), Message(EVENT, b'\0\1', 6, 6)])
    assert interval.extents == {}


def test_a_beginning_beyond_the_recording_is_refused(drive):
    with pytest.raises(ValueError, match=r'--from .* must lie within'):
        RecordedFeed(drive, begin=1000.0)
