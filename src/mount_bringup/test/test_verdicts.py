"""What the supervisor makes of what the nodes tell on `/diagnostics`."""

import time

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.time import Time

from mount_bringup.graph.errors import GraphError
from mount_bringup.graph.nodes import CONTROL, DRIVER, SIMULATED
from mount_bringup.graph.verdicts import Verdicts


@pytest.fixture
def verdicts():
    """The verdicts of a graph in the namespace `car`."""
    return Verdicts(SIMULATED, '/car')


def tell(verdicts, name, sentence='', sent=0, **figures):
    values = [KeyValue(key=key, value=str(value)) for key, value in figures.items()]
    status = DiagnosticStatus(name=name, level=DiagnosticStatus.ERROR, message=sentence, values=values)
    report = DiagnosticArray(status=[status])
    report.header.stamp = Time(nanoseconds=sent).to_msg()
    verdicts.take(report)


def test_what_a_node_calls_fatal_ends_the_graph_with_its_sentence(verdicts):
    tell(verdicts, 'car/mount_driver', 'coil switched off', fatal=False)
    verdicts.check_fatal()
    tell(verdicts, 'car/mount_driver', 'coil switched off: over_current', fatal=True)
    with pytest.raises(GraphError, match=r'^mount_driver: coil switched off: over_current$'):
        verdicts.check_fatal()


@pytest.mark.parametrize(
    'name', ['mount_driver', 'bus/mount_driver', 'car/left/mount_driver', 'car/gearbox_driver']
)
def test_nodes_of_others_end_no_graph(verdicts, name):
    tell(verdicts, name, 'broken', fatal=True, needs_initialisation=True)
    verdicts.check_fatal()
    assert verdicts.needing_initialisation() == ''


def test_who_asks_for_an_initialisation_is_named_until_it_is_forgotten(verdicts):
    tell(verdicts, 'car/mount_driver', 'counters jumped', needs_initialisation=True)
    assert verdicts.needing_initialisation() == 'mount_driver: counters jumped'
    verdicts.forget(DRIVER)
    assert verdicts.needing_initialisation() == ''


@pytest.mark.parametrize(
    ('driver', 'control', 'silent'), [(7, 6, CONTROL), (6, 6, DRIVER), ('none', 7, DRIVER), (7, 7, None)]
)
def test_the_first_node_that_has_not_handled_the_waiting_sample_does_not_answer(
    verdicts, driver, control, silent
):
    tell(verdicts, 'car/mount_driver', last_stamp=driver)
    tell(verdicts, 'car/mount_control', last_stamp=control)
    tell(verdicts, 'car/mount_sim', 'sample 3 was not answered', fatal=True, waiting_stamp=7)
    with pytest.raises(GraphError) as caught:
        verdicts.check_fatal()
    blamed = f'; {silent.name} does not answer' if silent else ''
    assert str(caught.value) == f'mount_sim: sample 3 was not answered{blamed}'


def test_what_a_node_told_before_its_activation_does_not_take_it_back(verdicts):
    before = time.time_ns()
    verdicts.note_active(DRIVER)
    tell(verdicts, 'car/mount_driver', 'inactive', before, state='inactive')
    assert verdicts.figures(DRIVER)['state'] == 'active'
    tell(verdicts, 'car/mount_driver', 'inactive', time.time_ns(), state='inactive')
    assert verdicts.figures(DRIVER)['state'] == 'inactive'


@pytest.mark.parametrize('newer', [True, False])
def test_a_clock_that_steps_back_after_an_activation_hides_no_end_of_it(verdicts, monkeypatch, newer):
    """Neither after a newer stamp nor after a moment: then every stamp is older for an hour."""
    now = time.time_ns()
    verdicts.note_active(DRIVER)
    if newer:
        tell(verdicts, 'car/mount_driver', 'active', time.time_ns(), state='active')
    else:
        later = time.monotonic() + 3.0
        monkeypatch.setattr(time, 'monotonic', lambda: later)
    tell(verdicts, 'car/mount_driver', 'inactive', now - 3600 * 10**9, state='inactive')
    assert verdicts.figures(DRIVER)['state'] == 'inactive'
