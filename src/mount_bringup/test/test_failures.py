"""The policy after a failure of nodes: action, limit, and when a node is treated as failed."""

import pytest

from mount_bringup.graph.failures import (
    ACTIONS,
    FailureCount,
    NodeFailure,
    RecoveryAction,
    recovery_action,
    table_holds,
)
from mount_bringup.graph.nodes import (
    CONTROL,
    DRIVER,
    INIT,
    RECORDER,
    SIM,
    SIMULATED,
    VEHICLE,
    GraphError,
    Grouping,
    groups,
)
from mount_bringup.graph.reports import SILENCE_LIMIT, Silence


@pytest.mark.parametrize(
    ('nodes', 'holds', 'expected'),
    [
        ((RECORDER,), True, RecoveryAction.RECORD_ANEW),
        ((RECORDER,), False, RecoveryAction.RECORD_ANEW),
        ((CONTROL,), True, RecoveryAction.DAMP_ON),
        ((CONTROL,), False, RecoveryAction.INITIALISE),
        ((INIT,), True, RecoveryAction.STAND_BY),
        ((INIT, CONTROL), True, RecoveryAction.INITIALISE),  # the table was latched by the node that died
        ((DRIVER,), True, RecoveryAction.INITIALISE),
        ((DRIVER, INIT, CONTROL), True, RecoveryAction.INITIALISE),
        ((RECORDER, CONTROL), True, RecoveryAction.DAMP_ON),
        ((), True, RecoveryAction.INITIALISE),  # the electronics were reset
        ((SIM,), True, RecoveryAction.END),
        ((SIM, CONTROL), True, RecoveryAction.END),
    ],
)
def test_what_follows_the_loss_of_nodes(nodes, holds, expected):
    assert recovery_action(NodeFailure(nodes, 'lost'), table_holds=holds) is expected


def test_every_node_has_an_action():
    assert {*ACTIONS} == {node.name for node in (*SIMULATED, *VEHICLE)}


def test_a_node_that_is_lost_again_and_again_ends_the_graph_with_the_limit_in_the_sentence():
    count, failure = FailureCount(2), NodeFailure((CONTROL,), 'mount_control ended with code -9')
    count.note(failure, 0.0)
    count.note(failure, 30.0)
    count.note(NodeFailure((RECORDER,), 'another one'), 31.0)
    with pytest.raises(GraphError, match=r'-9; mount_control was lost 3 times within 60 s \(limit 2\).* 0 A'):
        count.note(failure, 59.0)


def test_losses_of_long_ago_count_no_more():
    count, failure = FailureCount(1), NodeFailure((), 'the electronics were reset')
    for time in (0.0, 61.0, 122.0):
        count.note(failure, time)
    with pytest.raises(GraphError, match='electronics was lost 2 times'):
        count.note(failure, 123.0)


def test_without_restarts_the_first_loss_ends_the_graph_with_its_reason_alone():
    with pytest.raises(GraphError, match=r'^mount_control ended$'):
        FailureCount(0).note(NodeFailure((CONTROL,), 'mount_control ended'), 0.0)


def test_the_loss_of_the_simulated_electronics_ends_the_graph():
    with pytest.raises(GraphError, match='mount_sim ended; without it there is no coil to drive'):
        FailureCount(3).note(NodeFailure((SIM,), 'mount_sim ended'), 0.0)


MEASURING = {'state': 'active', 'restarts': '0', 'gaps': '0', 'samples': '9000', 'lost': '5',
             'last_stamp': '10000000000', 'sample_rate': '1000.0'}  # fmt: skip
LATCHED = {'state': 'active', 'last_stamp': '4000000000'}


@pytest.mark.parametrize(
    ('driver', 'init', 'expected'),
    [
        ({}, {}, True),
        ({'gaps': '1'}, {}, False),
        ({'restarts': '1'}, {}, False),
        ({'samples': '5900'}, {}, False),  # activated since: electronics and driver may have been away
        ({'sample_rate': '2000.0'}, {}, False),  # 9000 samples are 4.5 s
        ({'state': 'inactive'}, {}, False),
        ({'needs_initialisation': 'True'}, {}, False),
        ({}, {'state': 'inactive'}, False),
        ({'samples': 'unknown'}, {}, False),
    ],
)
def test_a_table_holds_only_while_the_driver_has_measured_without_a_break_since_before_it(
    driver, init, expected
):
    assert table_holds({**MEASURING, **driver}, {**LATCHED, **init}) is expected


def test_a_table_of_which_nothing_is_known_does_not_hold():
    assert not table_holds({}, LATCHED)
    assert not table_holds(MEASURING, {})


def silent_after(silence, begin, end, step=0.05):
    """Check from `begin` to `end` as the supervisor does; return the nodes that are silent at the end."""
    silent = []
    for number in range(round((end - begin) / step) + 1):
        silent = silence.silent(begin + number * step)
    return silent


def test_a_node_that_tells_nothing_counts_as_dead_after_the_limit_and_not_before():
    silence = Silence()
    silence.note('mount_control', 100.0)
    assert silent_after(silence, 100.0, 100.0 + SILENCE_LIMIT - 0.1) == []
    silence.note('mount_driver', 103.0)
    assert silent_after(silence, 104.0, 104.1) == ['mount_control']


def test_time_in_which_the_supervisor_itself_stood_still_counts_for_no_one():
    silence = Silence()
    silence.note('mount_control', 100.0)
    silent_after(silence, 100.0, 101.0)
    assert silent_after(silence, 200.0, 202.0) == []
    assert silent_after(silence, 202.0, 204.0) == ['mount_control']


def test_nobody_is_expected_to_tell_anything_in_a_pause_or_after_a_restart():
    silence = Silence()
    silence.note('mount_control', 100.0)
    silence.note('mount_driver', 100.0)
    silence.forget('mount_driver')
    silence.pause()
    assert silent_after(silence, 160.0, 163.0) == []
    assert silent_after(silence, 163.0, 165.0) == ['mount_control']


@pytest.mark.parametrize(
    ('grouping', 'expected'),
    [
        (Grouping.APART, [[RECORDER], [DRIVER], [SIM], [INIT], [CONTROL]]),
        (Grouping.COMPOSED, [[RECORDER], [DRIVER, INIT, CONTROL], [SIM]]),
        (Grouping.TOGETHER, [[RECORDER, DRIVER, SIM, INIT, CONTROL]]),
    ],
)
def test_which_nodes_share_a_process(grouping, expected):
    assert groups(SIMULATED, grouping) == expected
