"""From messages to what is shown: extents that hold every sample, state, and what stands beside."""

import numpy as np
import pytest

import engine_mount
from engine_mount.view.feed.feed import FeedError, Message
from engine_mount.view.feed.recorded import Recorded
from engine_mount.view.window.model import Model
from engine_mount.view.window.told import told_panels, told_state
from mount_ros.topics import DISPLACEMENT, EVENT


def messages_of(drive):
    """Return all messages of a recording in the order of their arrival."""
    feed = Recorded(drive, rate=1000.0)
    return feed, [feed._message(number) for number in range(len(feed._arrivals))]


@pytest.fixture(scope='module')
def shown(drive):
    """Return the model behind the whole drive, in intervals of 250 messages."""
    feed, messages = messages_of(drive)
    model = Model(feed)
    for begin in range(0, len(messages), 250):
        model.interval(messages[begin : begin + 250])
    return model


def highest(model, key):
    return max(interval.extents[key][1] for interval in model.intervals if key in interval.extents)


def test_no_peak_is_lost_between_the_intervals(drive, shown):
    recorded = engine_mount.open(drive)
    peak = 1e3 * recorded['displacement']['mount'].max()
    assert np.nanmax([one.extents['displacement'][1] for one in shown.intervals]) == pytest.approx(peak)
    assert np.nanmax([one.extents['setpoint'][1] for one in shown.intervals]) == pytest.approx(3.0)


def test_time_is_that_of_the_stamps(shown):
    times = [interval.time for interval in shown.intervals]
    assert times == sorted(times)
    assert times[-1] == pytest.approx(6.999, abs=0.001)


def test_the_undamped_mount_beside_swings_further_than_the_one_that_is_driven(shown):
    driven = np.nanmax([one.extents['displacement'][1] for one in shown.intervals])
    assert highest(shown, 'beside.undamped') > 1.2 * driven
    assert 0.0 < highest(shown, 'beside.hydro') < highest(shown, 'beside.undamped')


def test_the_policy_that_is_driven_does_not_stand_beside_itself(shown):
    assert {one.key for one in shown.beside.alternatives} == {'hydro', 'undamped', 'switched_viscous'}


def test_gap_and_levels_are_told(shown):
    values = {entry['name']: entry['value'] for entry in told_state(shown)['values']}
    assert values['contact gap'].startswith('349.')
    levels = told_panels(shown)[0]['levels']
    assert [level['label'] for level in levels] == ['damping begins', 'damping is full']


def test_a_malformed_message_is_no_end(drive):
    feed, _ = messages_of(drive)
    model = Model(feed, beside=False)
    interval = model.interval([Message(DISPLACEMENT, b'\0' * 40, 5, 5), Message(EVENT, b'\0\1', 6, 6)])
    assert np.isnan(interval.extents['displacement'][0])
    assert model.malformed == 1


def test_a_rate_beyond_its_limits_is_refused(drive):
    with pytest.raises(FeedError, match='must lie within'):
        Recorded(drive, rate=0.0)


def test_a_beginning_behind_the_end_is_refused(drive):
    with pytest.raises(FeedError, match='--from'):
        Recorded(drive, begin=1000.0)
