"""The supervisor's reading of `/diagnostics`."""

import time

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.time import Time

from mount_bringup.graph.nodes import CONTROL, DRIVER, SIMULATED, GraphError
from mount_bringup.graph.reports import SILENCE_LIMIT, NodeReports


@pytest.fixture
def reports():
    """The reports of a graph in the namespace `car`."""
    return NodeReports(SIMULATED, '/car')


def report(reports, name, sentence='', sent=0, **figures):
    values = [KeyValue(key=key, value=str(value)) for key, value in figures.items()]
    status = DiagnosticStatus(name=name, level=DiagnosticStatus.ERROR, message=sentence, values=values)
    message = DiagnosticArray(status=[status])
    message.header.stamp = Time(nanoseconds=sent).to_msg()
    reports.take(message)


def test_what_a_node_calls_fatal_ends_the_graph_with_its_sentence(reports):
    report(reports, 'car/mount_driver', 'coil switched off', fatal=False)
    reports.check_fatal()
    report(reports, 'car/mount_driver', 'coil switched off: over_current', fatal=True)
    with pytest.raises(GraphError, match=r'^mount_driver: coil switched off: over_current$'):
        reports.check_fatal()


@pytest.mark.parametrize(
    'name', ['mount_driver', 'bus/mount_driver', 'car/left/mount_driver', 'car/gearbox_driver']
)
def test_foreign_nodes_end_no_graph(reports, name):
    report(reports, name, 'broken', fatal=True, needs_initialisation=True)
    reports.check_fatal()
    assert reports.initialisation_request() == ''


def test_a_request_for_an_initialisation_names_its_node_until_it_is_forgotten(reports):
    report(reports, 'car/mount_driver', 'counters jumped', needs_initialisation=True)
    assert reports.initialisation_request() == 'mount_driver: counters jumped'
    reports.forget(DRIVER)
    assert reports.initialisation_request() == ''


@pytest.mark.parametrize(
    ('driver', 'control', 'silent'), [(7, 6, CONTROL), (6, 6, DRIVER), ('none', 7, DRIVER), (7, 7, None)]
)
def test_the_first_node_that_has_not_handled_the_waiting_sample_does_not_answer(
    reports, driver, control, silent
):
    report(reports, 'car/mount_driver', last_stamp=driver)
    report(reports, 'car/mount_control', last_stamp=control)
    report(reports, 'car/mount_sim', 'sample 3 was not answered', fatal=True, waiting_stamp=7)
    with pytest.raises(GraphError) as caught:
        reports.check_fatal()
    blamed = f'; {silent.name} does not answer' if silent else ''
    assert str(caught.value) == f'mount_sim: sample 3 was not answered{blamed}'


def test_a_report_from_before_an_activation_does_not_take_it_back(reports):
    before = time.time_ns()
    reports.note_active(DRIVER)
    report(reports, 'car/mount_driver', 'inactive', before, state='inactive')
    assert reports.figures(DRIVER)['state'] == 'active'
    report(reports, 'car/mount_driver', 'inactive', time.time_ns(), state='inactive')
    assert reports.figures(DRIVER)['state'] == 'inactive'


@pytest.mark.parametrize('newer', [True, False])
def test_a_clock_that_steps_back_after_an_activation_hides_no_end_of_it(reports, monkeypatch, newer):
    """Neither after a newer stamp nor after a moment: then every stamp is older for an hour."""
    now = time.time_ns()
    reports.note_active(DRIVER)
    if newer:
        report(reports, 'car/mount_driver', 'active', time.time_ns(), state='active')
    else:
        later = time.monotonic() + 3.0
        monkeypatch.setattr(time, 'monotonic', lambda: later)
    report(reports, 'car/mount_driver', 'inactive', now - 3600 * 10**9, state='inactive')
    assert reports.figures(DRIVER)['state'] == 'inactive'


@pytest.fixture
def clock(monkeypatch):
    """The steady clock, which goes on by `wait` as the supervisor checks; it returns the silent nodes."""
    now = [100.0]
    monkeypatch.setattr(time, 'monotonic', lambda: now[0])

    def wait(reports, duration):
        for _ in range(round(duration / 0.05)):
            now[0] += 0.05
            silent = reports.silent()
        return silent

    wait.stop = lambda duration: now.append(now.pop() + duration)
    return wait


def test_a_node_without_reports_is_silent_after_the_limit_and_not_before(reports, clock):
    report(reports, 'car/mount_control')
    assert clock(reports, SILENCE_LIMIT - 0.1) == []
    report(reports, 'car/mount_driver')
    assert clock(reports, 0.2) == ['mount_control']


def test_time_in_which_the_supervisor_itself_stood_still_does_not_count(reports, clock):
    report(reports, 'car/mount_control')
    clock(reports, 1.0)
    clock.stop(100.0)
    assert clock(reports, 2.0) == []
    assert clock(reports, 2.0) == ['mount_control']


def test_no_node_is_silent_in_a_pause_or_after_a_restart(reports, clock):
    report(reports, 'car/mount_control')
    report(reports, 'car/mount_driver')
    reports.forget(DRIVER)
    reports.pause_silence()
    clock.stop(60.0)
    assert clock(reports, 3.0) == []
    assert clock(reports, 2.0) == ['mount_control']
