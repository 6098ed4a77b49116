"""Who works in real time, when, and how the priority is given back."""

import re

import pytest

from mount_ros.nodes import real_time
from mount_ros.nodes.real_time import WATCH_PERIOD, RealTime, RealTimeThreads

NAMES = {
    1: 'MainThread', 2: 'mount_driver', 3: 'diagnostics', 4: 'data', 5: 'can_receive',
    6: 'dds.udp.12413', 7: 'dds.shm.wdog', 8: 'dds.asyn.0.0', 9: 'dds.ev.0', 10: 'dds.udp.12412',
}  # fmt: skip
WATCH, BESIDE, LOOP = 1, {2, 3}, {4, 5, 6}
ALL = {WATCH, *BESIDE, *LOOP}


class Loop:
    def __init__(self, interpreter=True):
        self.real_time_threads = RealTimeThreads(frozenset({'data', 'can_receive'}), interpreter)


class FakeThreads:
    def __init__(self, permitted=True):
        self.priorities = dict.fromkeys(NAMES, 0)
        self.shown = dict(NAMES)
        self.times = dict.fromkeys(NAMES, 0.0)
        self.permitted = permitted

    def names(self):
        return self.shown

    def run(self, number, priority):
        if not self.permitted:
            raise PermissionError
        self.priorities[number] = priority
        self.latest = number

    def of_python(self):
        return {WATCH, *BESIDE, 4, 5} & self.shown.keys()

    def processor_time(self, number):
        return self.times[number]

    def prioritised(self):
        return {number for number, priority in self.priorities.items() if priority}


@pytest.fixture
def system(monkeypatch):
    system = FakeThreads()
    system.bounds = []
    system.now = 0.0
    monkeypatch.setattr(real_time.threading, 'get_native_id', lambda: WATCH)
    monkeypatch.setattr(real_time, 'limit_without_sleep', lambda *limits: system.bounds.append(limits))
    return system


def shared(system, priority=10):
    return RealTime(priority, system, lambda: system.now)


def test_the_threads_of_the_data_have_the_priority_while_a_node_is_active(system):
    whole, loop = shared(system), Loop()
    assert not system.prioritised()
    whole.begin(loop)
    assert system.prioritised() == ALL
    assert {system.priorities[number] for number in LOOP} == {10}
    assert whole.held == 10
    whole.end(loop)
    assert not system.prioritised()
    assert whole.held == 0


def test_who_can_wait_for_the_interpreter_leaves_the_others_ordinary(system):
    whole = shared(system, priority=5)
    whole.begin(Loop(interpreter=False))
    assert system.prioritised() == {WATCH, *LOOP}


def test_the_watch_runs_above_the_loop_who_takes_turns_with_it_behind_and_the_system_bounds_both(system):
    whole = shared(system)
    whole.begin(Loop())
    assert system.priorities[WATCH] == 11
    assert {system.priorities[number] for number in BESIDE} == {9}
    assert system.bounds


def test_a_thread_made_by_the_activation_has_it_by_the_next_look(system):
    del system.shown[5]
    whole = shared(system)
    whole.begin(Loop())
    system.shown[5] = 'can_receive'
    assert 5 not in system.prioritised()
    whole.check()
    assert 5 in system.prioritised()


def test_of_two_nodes_in_a_process_the_last_one_ends_it(system):
    whole, first, second = shared(system), Loop(), Loop()
    whole.begin(first)
    whole.begin(second)
    whole.end(first)
    assert system.prioritised() == ALL
    whole.end(second)
    assert not system.prioritised()


@pytest.mark.parametrize(('priority', 'permitted'), [(0, True), (10, False)])
def test_without_a_priority_or_permission_nothing_is_changed(system, priority, permitted):
    system.permitted = permitted
    whole = shared(system, priority)
    whole.begin(Loop())
    whole.check()
    assert (system.prioritised(), whole.held) == (set(), 0)


def worked(whole, system, share):
    """Return what the watch said while a thread used a share of a core for 3 s."""
    said = []
    for _ in range(15):
        system.now += WATCH_PERIOD
        system.times[4] += share * WATCH_PERIOD
        said.append(whole.check())
    return ''.join(said)


def test_what_was_given_back_stays_so_until_an_activation_30_s_later(system):
    whole, loop = shared(system), Loop()
    whole.begin(loop)
    assert worked(whole, system, 0.75) == ''
    said = worked(whole, system, 0.9)
    assert re.search(r'thread data used 0\.\d\d of a core in 1\.\d s \(limit 0\.8\); lower the load', said)
    assert not system.prioritised()
    assert system.latest == WATCH  # before, what spins would keep the watch from the processor
    whole.end(loop)
    assert whole.given_back
    whole.begin(loop)
    assert whole.given_back  # so soon it is not taken again
    assert not system.prioritised()
    whole.end(loop)
    system.now += 30.0
    whole.begin(loop)
    assert not whole.given_back
    assert system.prioritised() == ALL
