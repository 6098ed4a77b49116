"""Which losses of a running graph are made good, how, how often, and which node counts as dead."""

import pytest

from mount_bringup.graph.errors import GraphError
from mount_bringup.graph.liveliness import SILENCE_LIMIT, Liveliness
from mount_bringup.graph.nodes import (
    CONTROL,
    DRIVER,
    INIT,
    RECORDER,
    SIM,
    SIMULATED,
    VEHICLE,
    Grouping,
    groups,
)
from mount_bringup.graph.restarts import (
    REMEDIES,
    Loss,
    Remedy,
    RestartCount,
    remedy,
    restartable,
    table_holds,
)


@pytest.mark.parametrize(
    ('nodes', 'holds', 'expected'),
    [
        ((RECORDER,), True, Remedy.RECORD_ANEW),
        ((RECORDER,), False, Remedy.RECORD_ANEW),
        ((CONTROL,), True, Remedy.DAMP_ON),
        ((CONTROL,), False, Remedy.INITIALISE),
        ((INIT,), True, Remedy.STAND_BY),
        ((INIT, CONTROL), True, Remedy.INITIALISE),  # the table was latched by the node that died
        ((DRIVER,), True, Remedy.INITIALISE),
        ((DRIVER, INIT, CONTROL), True, Remedy.INITIALISE),
        ((RECORDER, CONTROL), True, Remedy.DAMP_ON),
        ((), True, Remedy.INITIALISE),  # the electronics were reset
        ((SIM,), True, Remedy.END),
        ((SIM, CONTROL), True, Remedy.END),
    ],
)
def test_what_follows_the_loss_of_nodes(nodes, holds, expected):
    assert remedy(Loss(nodes, 'lost'), holds) is expected


def test_every_node_has_a_remedy():
    assert {*REMEDIES} == {node.name for node in (*SIMULATED, *VEHICLE)}


@pytest.mark.parametrize(
    ('nodes', 'limit', 'expected'),
    [((CONTROL,), 3, True), ((CONTROL,), 0, False), ((SIM,), 3, False), ((SIM, CONTROL), 3, False)],
)
def test_launch_respawns_only_what_is_ever_started_again(nodes, limit, expected):
    assert restartable(nodes, limit) is expected


def test_a_node_that_is_lost_again_and_again_ends_the_graph_with_the_limit_in_the_sentence():
    count, loss = RestartCount(2), Loss((CONTROL,), 'mount_control ended with code -9')
    count.note(loss, 0.0)
    count.note(loss, 30.0)
    count.note(Loss((RECORDER,), 'another one'), 31.0)
    with pytest.raises(GraphError, match=r'-9; mount_control was lost 3 times within 60 s \(limit 2\).* 0 A'):
        count.note(loss, 59.0)


def test_losses_of_long_ago_count_no_more():
    count, loss = RestartCount(1), Loss((), 'the electronics were reset')
    for time in (0.0, 61.0, 122.0):
        count.note(loss, time)
    with pytest.raises(GraphError, match='electronics was lost 2 times'):
        count.note(loss, 123.0)


def test_without_restarts_the_first_loss_ends_the_graph_with_its_reason_alone():
    with pytest.raises(GraphError, match=r'^mount_control ended$'):
        RestartCount(0).note(Loss((CONTROL,), 'mount_control ended'), 0.0)


def test_the_loss_of_the_simulated_electronics_ends_the_graph():
    with pytest.raises(GraphError, match='mount_sim ended; without it there is no coil to drive'):
        RestartCount(3).note(Loss((SIM,), 'mount_sim ended'), 0.0)


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


def watched(liveliness, begin, end, step=0.05):
    """Look from `begin` to `end` as the supervisor does; return who was silent at the end."""
    silent = []
    for number in range(round((end - begin) / step) + 1):
        silent = liveliness.silent(begin + number * step)
    return silent


def test_a_node_that_tells_nothing_counts_as_dead_after_the_limit_and_not_before():
    liveliness = Liveliness()
    liveliness.hear('mount_control', 100.0)
    assert watched(liveliness, 100.0, 100.0 + SILENCE_LIMIT - 0.1) == []
    liveliness.hear('mount_driver', 103.0)
    assert watched(liveliness, 104.0, 104.1) == ['mount_control']


def test_time_in_which_the_supervisor_itself_stood_still_counts_for_no_one():
    liveliness = Liveliness()
    liveliness.hear('mount_control', 100.0)
    watched(liveliness, 100.0, 101.0)
    assert watched(liveliness, 200.0, 202.0) == []
    assert watched(liveliness, 202.0, 204.0) == ['mount_control']


def test_nobody_is_expected_to_tell_anything_in_a_pause_or_after_a_restart():
    liveliness = Liveliness()
    liveliness.hear('mount_control', 100.0)
    liveliness.hear('mount_driver', 100.0)
    liveliness.forget('mount_driver')
    liveliness.pause()
    assert watched(liveliness, 160.0, 163.0) == []
    assert watched(liveliness, 163.0, 165.0) == ['mount_control']


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
