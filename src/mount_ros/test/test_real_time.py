"""Who works in real time, when, and how the priority is given back."""

import pytest

from mount_ros.nodes import real_time
from mount_ros.nodes.real_time import WATCH_PERIOD, RealTime, RealTimeThreads

NAMES = {
    1: 'MainThread', 2: 'mount_driver', 3: 'diagnostics', 4: 'data', 5: 'can_receive',
    6: 'dds.udp.12413', 7: 'dds.shm.wdog', 8: 'dds.asyn.0.0', 9: 'dds.ev.0', 10: 'dds.udp.12412',
}  # fmt: skip
WATCH, BESIDE, LOOP, TIMERS = 1, {2, 3}, {4, 5, 6}, 9
ALL = {WATCH, *BESIDE, *LOOP}


class Loop:
    def __init__(self, interpreter=True):
        self.real_time_threads = RealTimeThreads(frozenset({'data', 'can_receive'}), interpreter)


class FakeThreads:
    own = WATCH

    def __init__(self, permitted=True):
        self.priorities = dict.fromkeys(NAMES, 0)
        self.shown = dict(NAMES)
        self.times = dict.fromkeys(NAMES, 0.0)
        self.waiting = set()
        self.permitted = permitted

    def names(self):
        return self.shown

    def run(self, number, priority):
        if not self.permitted:
            raise PermissionError
        self.priorities[number] = priority

    def of_python(self):
        return {WATCH, *BESIDE, 4, 5} & self.shown.keys()

    def waits(self, number):
        return number in self.waiting

    def processor_time(self, number):
        return self.times[number]

    def prioritised(self):
        return {number for number, priority in self.priorities.items() if priority}


@pytest.fixture
def system(monkeypatch):
    system = FakeThreads()
    system.bounds = []
    system.now = 0.0
    monkeypatch.setattr(real_time, 'limit_without_sleep', lambda *limits: system.bounds.append(limits))
    return system


def shared(system, priority=10):
    return RealTime(priority, system, lambda: system.now)


def looks(whole, system, count, shares=None):
    """Look `count` times, while threads use `shares` of a core; return what was said."""
    said = []
    for _ in range(count):
        system.now += WATCH_PERIOD
        for number, share in (shares or {}).items():
            system.times[number] += share * WATCH_PERIOD
        said.append(whole.check())
    return [sentence for sentence in said if sentence]


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


def test_the_memory_of_a_process_in_real_time_stays_in_place(system, monkeypatch):
    for permitted in (True, False):
        monkeypatch.setattr(real_time, 'lock_memory', lambda permitted=permitted: permitted)
        whole, ordinary = shared(system), shared(system, priority=0)
        whole.keep_memory()
        ordinary.keep_memory()
        assert (whole.memory_locked, ordinary.memory_locked) == (permitted, False)


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
    looks(whole, system, 1)
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
    assert (looks(whole, system, 20), system.prioritised(), whole.held) == ([], set(), 0)
    assert whole.permitted == permitted


@pytest.mark.parametrize(('share', 'periods', 'kept'), [(0.75, 100, True), (0.9, 10, False), (1.0, 3, True)])
def test_a_thread_that_uses_more_than_its_share_for_a_second_ends_it(system, share, periods, kept):
    whole = shared(system)
    whole.begin(Loop())
    said = looks(whole, system, 10) + looks(whole, system, periods, {4: share}) + looks(whole, system, 10)
    assert (len(said), bool(system.prioritised())) == ((0, True) if kept else (1, False))
    if not kept:
        assert 'thread data used 0.90 of a core in 1.0 s (limit 0.8); lower the load' in said[0]
        assert whole.given_back == said[0]


def test_an_ordinary_thread_that_waits_for_a_processor_ends_it(system):
    whole = shared(system)
    whole.begin(Loop())
    assert looks(whole, system, 5) == []
    system.waiting = {TIMERS}
    said = looks(whole, system, round(1.0 / WATCH_PERIOD))
    assert len(said) == 1
    assert 'had to wait for a processor for 0.6 s (limit 0.6 s)' in said[0]
    assert not system.prioritised()


def test_an_ordinary_thread_that_is_seen_waiting_but_runs_between_is_served(system):
    whole = shared(system)
    whole.begin(Loop())
    system.waiting = {TIMERS}
    assert looks(whole, system, 50, {TIMERS: 0.001}) == []


def test_a_thread_that_the_system_says_does_not_sleep_ends_it_at_once(system):
    whole = shared(system)
    whole.begin(Loop())
    assert 'for 1 s without a sleep (limit 1 s)' in whole.ran_without_sleep()
    assert not system.prioritised()


def test_what_was_given_back_stays_so_until_an_activation_30_s_later(system):
    whole, loop = shared(system), Loop()
    whole.begin(loop)
    assert whole.ran_without_sleep()
    assert looks(whole, system, 20) == []
    assert not system.prioritised()
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
