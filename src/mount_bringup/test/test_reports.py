"""The supervisor's reading of `/diagnostics`."""

import time

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.time import Time

from mount_bringup.graph.nodes import CONTROL, DRIVER, SIMULATED, GraphError
from mount_bringup.graph.reports import NodeReports


@pytest.fixture
def reports():
    """The reports of a graph in the namespace `car`."""
    return NodeReports(SIMULATED, '/car')


def tell(reports, name, sentence='', sent=0, **figures):
    values = [KeyValue(key=key, value=str(value)) for key, value in figures.items()]
    status = DiagnosticStatus(name=name, level=DiagnosticStatus.ERROR, message=sentence, values=values)
    report = DiagnosticArray(status=[status])
    report.header.stamp = Time(nanoseconds=sent).to_msg()
    reports.take(report)


def test_what_a_node_calls_fatal_ends_the_graph_with_its_sentence(reports):
    tell(reports, 'car/mount_driver', 'coil switched off', fatal=False)
    reports.check_fatal()
    tell(reports, 'car/mount_driver', 'coil switched off: over_current', fatal=True)
    with pytest.raises(GraphError, match=r'^mount_driver: coil switched off: over_current$'):
        reports.check_fatal()


@pytest.mark.parametrize(
    'name', ['mount_driver', 'bus/mount_driver', 'car/left/mount_driver', 'car/gearbox_driver']
)
def test_nodes_of_others_end_no_graph(reports, name):
    tell(reports, name, 'broken', fatal=True, needs_initialisation=True)
    reports.check_fatal()
    assert reports.initialisation_request() == ''


def test_who_asks_for_an_initialisation_is_named_until_it_is_forgotten(reports):
    tell(reports, 'car/mount_driver', 'counters jumped', needs_initialisation=True)
    assert reports.initialisation_request() == 'mount_driver: counters jumped'
    reports.forget(DRIVER)
    assert reports.initialisation_request() == ''


@pytest.mark.parametrize(
    ('driver', 'control', 'silent'), [(7, 6, CONTROL), (6, 6, DRIVER), ('none', 7, DRIVER), (7, 7, None)]
)
def test_the_first_node_that_has_not_handled_the_waiting_sample_does_not_answer(
    reports, driver, control, silent
):
    tell(reports, 'car/mount_driver', last_stamp=driver)
    tell(reports, 'car/mount_control', last_stamp=control)
    tell(reports, 'car/mount_sim', 'sample 3 was not answered', fatal=True, waiting_stamp=7)
    with pytest.raises(GraphError) as caught:
        reports.check_fatal()
    blamed = f'; {silent.name} does not answer' if silent else ''
    assert str(caught.value) == f'mount_sim: sample 3 was not answered{blamed}'


def test_what_a_node_told_before_its_activation_does_not_take_it_back(reports):
    before = time.time_ns()
    reports.note_active(DRIVER)
    tell(reports, 'car/mount_driver', 'inactive', before, state='inactive')
    assert reports.figures(DRIVER)['state'] == 'active'
    tell(reports, 'car/mount_driver', 'inactive', time.time_ns(), state='inactive')
    assert reports.figures(DRIVER)['state'] == 'inactive'


@pytest.mark.parametrize('newer', [True, False])
def test_a_clock_that_steps_back_after_an_activation_hides_no_end_of_it(reports, monkeypatch, newer):
    """Neither after a newer stamp nor after a moment: then every stamp is older for an hour."""
    now = time.time_ns()
    reports.note_active(DRIVER)
    if newer:
        tell(reports, 'car/mount_driver', 'active', time.time_ns(), state='active')
    else:
        later = time.monotonic() + 3.0
        monkeypatch.setattr(time, 'monotonic', lambda: later)
    tell(reports, 'car/mount_driver', 'inactive', now - 3600 * 10**9, state='inactive')
    assert reports.figures(DRIVER)['state'] == 'inactive'
