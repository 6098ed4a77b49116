"""The node between a driver and an initialisation that the test plays, in the real middleware."""

import math
import re
import sys
from pathlib import Path

import numpy as np
import pytest
from controllers import TABLE_ROWS, sine
from rclpy.lifecycle import TransitionCallbackReturn
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.serialization import deserialize_message, serialize_message
from ros_testing import wait_until
from std_msgs.msg import String

import mount_control
import mount_models
import mount_ros
from mount_control.controller import ControlLaw, Controller
from mount_control.node import MountControl
from mount_control.policy import switched_viscous
from mount_control.policy.contract import trace_fields
from mount_control.settings import control_settings
from mount_models.friction.coefficient import FrictionCoefficients
from mount_models.friction.contact import FrictionContact
from mount_models.specimen import DEFAULT_SPECIMEN, default_specimen, load_specimen
from mount_ros import topics
from mount_ros.data_path import DataPath
from mount_ros.messages.cdr import deserialise, message_class
from mount_ros.messages.event import Mark, ParametersChanged, read_change, read_mark
from mount_ros.messages.force_table import law_table_points, table_message
from mount_ros.messages.scalars import ScalarsLayout
from mount_ros.nodes.diagnostics import Level
from mount_ros.qos import publisher_qos

OWN = tuple(str(Path(package.__file__).parent) for package in (mount_control, mount_models, mount_ros))
MS = 1_000_000  # ns
ACTIVATION = 5000 * MS
SUCCESS, FAILURE = TransitionCallbackReturn.SUCCESS, TransitionCallbackReturn.FAILURE

PAPER = {'policy': 'switched_viscous'}


class Surroundings:
    """Plays driver and initialisation, and keeps what the controller sends."""

    def __init__(self, context, TABLE_ROWS):
        currents, forces, self._offset_current = TABLE_ROWS
        self._rows = np.array([currents, forces])
        self.node = Node('surroundings', context=context)
        self.path = DataPath(self.node, lockstep=True)
        self._layouts = {
            topic: ScalarsLayout(topic)
            for topic in (
                topics.DISPLACEMENT,
                topics.AIR_GAP,
                topics.CURRENT_SETPOINT,
            )
        }
        self._trace_layout = ScalarsLayout(topics.control_trace(trace_fields(switched_viscous)))
        self.setpoints, self.traces, self.events = [], [], []
        self._displacement = self.path.publisher(topics.DISPLACEMENT)
        self._air_gap = self.path.publisher(topics.AIR_GAP)
        self._table = self.path.publisher(topics.CURRENT_FORCE_TABLE)
        self.path.subscribe(topics.CURRENT_SETPOINT, lambda raw: self.setpoints.append(self._setpoint(raw)))
        self.path.subscribe(topics.CONTROL_TRACE, lambda raw: self.traces.append(self._trace(raw)))
        self.path.subscribe(
            topics.EVENT, lambda raw: self.events.append(deserialize_message(raw, String).data)
        )
        self.path.start()

    def add_law(self):
        """Play the part of electronics with a law of their own, too."""
        self.law_tables = []
        self._electronics = self.path.publisher(topics.ELECTRONICS_SETPOINT)
        self.path.subscribe(topics.ELECTRONICS_TABLE, self._load_law_table)

    def _load_law_table(self, raw):
        self.law_tables.append(law_table_points(raw))
        self.send_electronics(0, math.nan, loaded=bool(self.law_tables[-1]))

    def send_electronics(self, milliseconds, current, loaded=True):
        """Send a setpoint of the electronics' own law."""
        layout = ScalarsLayout(topics.ELECTRONICS_SETPOINT)
        self._electronics.publish(layout.pack(ACTIVATION + milliseconds * MS, (current, loaded)))

    def send(self, milliseconds, displacement=0.0):
        """Send a displacement sample, by its time in ms after the activation of the table."""
        stamp = ACTIVATION + round(milliseconds * MS)
        self._displacement.publish(self._layouts[topics.DISPLACEMENT].pack(stamp, (displacement,)))

    def send_air_gap(self, stamp=ACTIVATION, offset_current=None):
        offset = self._offset_current if offset_current is None else offset_current
        numbers = (508e-6, 349e-6, 1e-6, 1e-7, 22.3, offset)
        self._air_gap.publish(self._layouts[topics.AIR_GAP].pack(stamp, numbers))

    def send_table(self, stamp=ACTIVATION, rows=None):
        self._table.publish(table_message(stamp, self._rows if rows is None else rows))

    def send_raw_table(self, raw):
        self._table.publish(raw)

    def initialise(self):
        """Send what a finished initialisation leaves behind."""
        self.send(-1.0)
        self.send(0.0)
        self.send_air_gap()
        self.send_table()

    def _setpoint(self, raw):
        stamp, (current,), _ = self._layouts[topics.CURRENT_SETPOINT].unpack(raw)
        return (stamp - ACTIVATION) / MS, current

    def _trace(self, raw):
        stamp, numbers, _ = self._trace_layout.unpack(raw)
        return (stamp - ACTIVATION) / MS, dict(zip(self._trace_layout.names, numbers, strict=True))

    def close(self):
        self.path.stop()
        self.node.destroy_node()


@pytest.fixture
def make_control(make_node):
    """Return a function that creates a controller node with parameters, by default of the paper's policy."""
    return lambda **parameters: make_node(MountControl, **{'lockstep': True, **PAPER, **parameters})


@pytest.fixture
def around(context):
    surroundings = Surroundings(context, TABLE_ROWS)
    yield surroundings
    surroundings.close()


@pytest.fixture
def configured(make_control, around):
    """Return a function that configures a controller node and waits until both sides know each other."""

    def make(**parameters):
        control = make_control(**parameters)
        assert control.trigger_configure() == SUCCESS
        wait_until(lambda: not around.path.unmatched(), 'matched by the surroundings')
        wait_until(lambda: not control.data_path.unmatched(), 'matched by the controller')
        wait_until(lambda: control.data_path.node.count_subscribers('event'), 'who hears events')
        return control

    return make


@pytest.fixture
def active(configured, around):
    """Return a function that brings a controller node to work on a table of this activation."""

    def make(**parameters):
        control = configured(**parameters)
        around.initialise()
        assert control.trigger_activate() == SUCCESS
        return control

    return make


def _answers(around, count):
    wait_until(lambda: len(around.setpoints) >= count, f'{count} setpoints')
    return around.setpoints


def _shake(around, sine, every=1):
    """Shake until damping is on, 400 ms, and wait for each answer; return all setpoints."""
    displacement = sine(8.0, 1e-3, 0.4)
    for number, ms in enumerate(range(every, 401, every)):
        around.send(ms, displacement[ms - 1])
        _answers(around, number + 1)
    return around.setpoints


def test_each_displacement_is_answered_with_a_setpoint_and_a_trace_of_its_stamp(active, around):
    active()
    displacement = sine(8.0, 1e-3, 0.5)
    for number, x in enumerate(displacement):
        around.send(number + 1, x)
        _answers(around, number + 1)
    wait_until(lambda: len(around.traces) == len(displacement), 'all traces')
    assert [ms for ms, _ in around.setpoints] == list(range(1, len(displacement) + 1))
    assert [ms for ms, _ in around.traces] == [ms for ms, _ in around.setpoints]

    settings = control_settings(PAPER, default_specimen())
    core = Controller(ControlLaw(settings, settings.table(*TABLE_ROWS)))
    core.restart(displacement[0])
    expected = core.run(displacement)
    assert [current for _, current in around.setpoints] == expected['current'].tolist()
    assert expected['current'].max() > 0.9
    for (_, trace), record in zip(around.traces, expected, strict=True):
        np.testing.assert_array_equal(list(trace.values()), list(record.tolist()))


def test_a_sample_passes_few_functions_and_its_setpoint_leaves_before_its_trace_is_packed(
    active, monkeypatch
):
    """Calls of the product's own functions, over 1000 samples, compiled ones and publishing among them."""
    control, calls, until_setpoint = active(lockstep=False), [], []
    layout, send = ScalarsLayout(topics.DISPLACEMENT), control._send_setpoint

    def note(frame, event, argument):
        if event == 'call' and frame.f_code.co_filename.startswith(OWN):
            calls.append(frame.f_code.co_name)

    def send_and_note(raw):
        send(raw)
        until_setpoint.append(len(calls))

    monkeypatch.setattr(control, '_send_setpoint', send_and_note)
    motion = sine(8.0, 1e-3, 1.0)
    raws = [layout.pack(ACTIVATION + (ms + 1) * MS, (x,)) for ms, x in enumerate(motion)]
    control._on_displacement(raws[0])  # the first one begins afresh
    until_setpoint.clear()
    for raw in raws[1:]:
        calls.clear()
        sys.setprofile(note)
        control._on_displacement(raw)
        sys.setprofile(None)
        assert len(calls) <= 10, calls
        assert until_setpoint[-1] <= 8, calls
        assert calls.index('pack_record') >= until_setpoint[-1]
    assert len(until_setpoint) == 999
    assert control.loop.counts.samples == 1000
    assert control.loop.damping_active


def test_in_lock_step_the_sample_that_waits_is_answered_at_activation(configured, around):
    control = configured()
    around.initialise()
    around.send(1.0, 0.001)
    wait_until(lambda: control.loop.last == ACTIVATION + MS, 'the sample')
    assert control.trigger_activate() == SUCCESS
    assert _answers(around, 1) == [(1.0, 0.0)]


def test_parameters_that_cannot_work_are_refused_at_configure(make_control):
    control = make_control(switch_off_level=0.0009)
    assert control.trigger_configure() == FAILURE
    assert 'switch_off_level (0.9 mm) must lie below switch_on_level (0.8 mm)' in control.sentence
    assert control.data_path is None


def test_silence_in_real_time_is_an_error(active, around):
    control = active(lockstep=False)
    around.send(1.0)
    _answers(around, 1)
    wait_until(lambda: control.judge().level is Level.ERROR, 'the verdict on silence')
    assert '0 A: no displacement for' in control.judge().sentence


@pytest.fixture
def stranger(context):
    """Return a function that lets another node publish a topic."""
    nodes = []

    def publish(topic, name='/elsewhere/evil'):
        namespace, _, name = name.rpartition('/')
        nodes.append(Node(name, namespace=namespace, context=context))
        nodes[-1].create_publisher(message_class(topic.type), f'/{topic.name}', publisher_qos(topic))
        return nodes[-1]

    yield publish
    for node in nodes:
        node.destroy_node()


@pytest.mark.parametrize('topic', [topics.DISPLACEMENT, topics.AIR_GAP, topics.CURRENT_FORCE_TABLE])
def test_another_node_that_publishes_what_control_hears_ends_the_damping_at_0_ampere(
    active, around, stranger, topic
):
    control = active()
    assert _shake(around, sine)[-1][1] > 0.4
    other = stranger(topic)
    wait_until(lambda: control.loop.foreign, 'the other to be noticed')
    around.send(401, 0.0)
    around.send(402, 0.0)
    assert _answers(around, 402)[400:] == [(401.0, 0.0), (402.0, 0.0)]
    verdict = control.judge()
    own = topic.writers[0]
    assert (verdict.level, verdict.figures['fatal']) == (Level.ERROR, True)
    assert verdict.sentence == (
        f'0 A: /elsewhere/evil and /surroundings_io must not publish {topic.name} too (limit: one writer, '
        f'{own}): end it, then activate mount_init and mount_control again'
    )
    assert control.trigger_deactivate() == SUCCESS
    assert control.trigger_activate() == FAILURE
    assert control.sentence.startswith('/elsewhere/evil and /surroundings_io must not publish')
    other.destroy_node()
    wait_until(lambda: not control.data_path.publisher_watch.confirmed, 'the end of the other')
    assert control.trigger_activate() == FAILURE  # the table may have been the other's
    assert 'activate mount_init' in control.sentence
    around.initialise()
    assert control.trigger_activate() == SUCCESS
    around.send(403, 0.0)
    assert _answers(around, 403)[-1] == (403.0, 0.0)


@pytest.mark.parametrize('lockstep', [True, False])
def test_another_writer_ends_a_graph_in_lock_step_alone(active, lockstep):
    control = active(lockstep=lockstep)
    control.loop.foreign = '10 samples were repeated: end one'
    verdict = control.judge()
    assert (verdict.level, verdict.figures['fatal']) == (Level.ERROR, lockstep)
    assert verdict.sentence.startswith('0 A: 10 samples were repeated')


def test_while_a_writer_may_be_one_that_was_killed_control_answers_0_ampere_and_then_goes_on(
    active, around, stranger
):
    control = active()
    assert _shake(around, sine)[-1][1] > 0.4
    twin = stranger(topics.DISPLACEMENT, '/surroundings_io')
    wait_until(lambda: control.loop.writer_doubt, 'the doubt')
    around.send(401, 0.0)
    assert _answers(around, 401)[-1] == (401.0, 0.0)
    assert control.judge().sentence.startswith('0 A while this lasts: /surroundings_io must not publish')
    twin.destroy_node()
    wait_until(lambda: not control.loop.writer_doubt, 'the end of the doubt')
    around.send(402, 0.0)
    assert _answers(around, 402)[-1][1] > 0.4


def test_the_speed_of_the_engine_is_traced_until_another_node_publishes_it_too_and_damping_goes_on(
    active, around, stranger
):
    control, layout = active(), ScalarsLayout(topics.ENGINE_SPEED)
    assert 'engine_speed' not in control.judge().sentence
    vehicle = around.path.publisher(topics.ENGINE_SPEED)
    wait_until(lambda: vehicle.get_subscription_count(), 'the control')

    def send_speed(ms):
        vehicle.publish(layout.pack(ACTIVATION + ms * MS, (math.nan,), (30.0 * math.pi,)))

    _shake(around, sine)
    send_speed(400)
    wait_until(lambda: control.loop.engine_speed.last, 'the speed')
    for ms in (404, 405):
        around.send(ms)
    assert _answers(around, 402)[-1][1] > 0.4
    wait_until(lambda: around.traces[-1][0] == 405.0, 'the traces')
    assert [trace['crank_frequency'] for _, trace in around.traces[-2:]] == [0.0, pytest.approx(15.0)]
    other = stranger(topics.ENGINE_SPEED)
    wait_until(lambda: send_speed(406) or control.loop.engine_speed.conflict, 'the other')
    for ms in (412, 413):
        around.send(ms)
    assert _answers(around, 404)[-1][1] > 0.4
    wait_until(lambda: around.traces[-1][0] == 413.0, 'the traces')
    assert around.traces[-1][1]['crank_frequency'] == 0.0
    verdict = control.judge()
    assert verdict.level is Level.WARN
    assert 'engine_speed not used, the law follows the displacement alone: ' in verdict.sentence
    assert 'must not publish engine_speed too (limit: one writer, mount_driver)' in verdict.sentence
    other.destroy_node()
    wait_until(lambda: send_speed(420) or not control.loop.engine_speed.conflict, 'its end')


def test_deactivation_leaves_0_ampere_and_silence(active, around):
    control = active()
    assert _shake(around, sine)[-1][1] > 0.4
    assert control.trigger_deactivate() == SUCCESS
    assert _answers(around, 401)[-1] == (400.0, 0.0)
    around.send(401, 0.001)
    wait_until(lambda: control.loop.last == ACTIVATION + 401 * MS, 'the sample')
    assert control.trigger_activate() == SUCCESS  # the same measurements, so the same table holds
    assert _answers(around, 402)[401:] == [(401.0, 0.0)]


def test_the_end_of_the_process_leaves_0_ampere(active, around):
    control = active()
    assert _shake(around, sine)[-1][1] > 0.4
    control.close()
    assert _answers(around, 401)[-1] == (400.0, 0.0)


def test_without_a_table_that_can_be_the_node_does_not_become_active(configured, around):
    control = configured()
    around.send(0.0)
    around.send_air_gap(offset_current=math.nan)
    around.send_table()
    assert control.trigger_activate() == FAILURE
    assert 'offset_current (nan A) must lie within 0 .. 3 A' in control._refusal
    assert not control.active
    assert around.setpoints == []


def test_a_message_that_is_no_table_takes_the_old_one_away(configured, around):
    control = configured()
    around.initialise()
    wait_until(lambda: control._activation.table is not None, 'the table')
    raw = table_message(ACTIVATION, [[0.47, 3.0], [0.0, 300.0]])
    message = deserialise(raw, topics.CURRENT_FORCE_TABLE.type)
    message.layout.dim[1].label = 'of yesterday'
    around.send_raw_table(serialize_message(message))
    wait_until(lambda: control._activation.table is None, 'the message')
    assert control.trigger_activate() == FAILURE
    assert 'no current_force_table was received' in control._refusal


def test_latched_results_are_found_by_a_controller_that_comes_later(around, configured):
    around.send_air_gap()
    around.send_table()
    control = configured()
    around.send(0.0)
    assert control.trigger_activate() == SUCCESS


def test_after_cleanup_the_old_table_is_forgotten(active, around):
    control = active()
    assert control.trigger_deactivate() == SUCCESS
    assert control.trigger_cleanup() == SUCCESS
    assert (control._activation.table, control._activation.air_gap) == (None, None)
    assert control.loop.first is None


def test_the_friction_of_a_specimen_is_in_the_parameters_that_the_session_will_tell(make_control, tmp_path):
    """What is set on purpose stays, even if it is the default; core and node agree on the rest."""
    friction = '\nfriction: {a_p1: 0.4, a_p2: 0.05, contact_stiffness: 3.0e+6}'
    text = re.sub(r'\nfriction: \{[^}]*\}', friction, DEFAULT_SPECIMEN.read_text(), count=1)
    (tmp_path / 'left.yaml').write_text(text)
    default = FrictionCoefficients().a_p1
    settings = {'parameters_file': str(tmp_path / 'left.yaml'), 'friction.a_p1': default}
    control = make_control(**settings)
    assert control.trigger_configure() == SUCCESS
    names = ('friction.a_p1', 'friction.a_p2', 'contact.contact_stiffness')
    assert [control.get_parameter(name).value for name in names] == [default, 0.05, 3e6]
    assert control._settings.friction == FrictionCoefficients(a_p2=0.05)
    assert control._settings.contact == FrictionContact(contact_stiffness=3e6)
    specimen = load_specimen(tmp_path / 'left.yaml')
    assert control_settings(settings, specimen).friction == control._settings.friction
    # another file, another friction
    assert control.trigger_cleanup() == SUCCESS
    control.set_parameters([Parameter('parameters_file', value='')])
    assert control.trigger_configure() == SUCCESS
    expected = control_settings(settings, default_specimen())
    assert control._settings.friction == expected.friction


# Parameters of a node at work.


def _set(control, **values):
    """Set parameters one after the other, as `ros2 param set` does; return the reasons of those refused."""
    results = [control.set_parameters([Parameter(name, value=v)])[0] for name, v in values.items()]
    return [result.reason for result in results if not result.successful]


@pytest.mark.parametrize(
    'values',
    [
        {'damper': 'viscous_2500'},
        {'damper': '{velocity: [0, 0.004, 0.1], force: [0, 0, 200]}'},
        {'switch_off_level': 0.0002, 'switch_on_level': 0.0006},
        {'eigenfrequency': 10.0},
        {'lead_time': 0.005},
        {'quality': 0.6},
        {'switching': 'always'},
    ],
)
def test_what_is_set_on_a_node_at_work_acts_from_the_next_sample_and_is_told(active, around, values):
    control = active()
    displacement = sine(8.0, 1e-3, 0.6)
    _shake(around, sine)
    before = {name: control.get_parameter(name).value for name in values}
    assert _set(control, **values) == []
    for number in range(401, 600):
        around.send(number, displacement[number - 1])
        _answers(around, number)
    settings = control_settings(PAPER, default_specimen())
    table = settings.table(*TABLE_ROWS)
    core = Controller(ControlLaw(settings, table))
    core.restart(displacement[0])
    expected = core.run(displacement[:400])['current'].tolist()
    for count in range(len(values)):  # each by itself, as it was set
        so_far = PAPER | dict(list(values.items())[: count + 1])
        core.change(ControlLaw(control_settings(so_far, default_specimen()), table))
    expected += core.run(displacement[400:599])['current'].tolist()
    assert [current for _, current in around.setpoints] == expected
    assert around.setpoints[400][1] == around.setpoints[399][1]  # no jump
    wait_until(lambda: len(around.events) == len(values), 'the events')
    stamp = ACTIVATION + 401 * MS
    for text, (name, value) in zip(around.events, values.items(), strict=True):
        assert read_change(text) == ParametersChanged(stamp, 'mount_control', {name: value})
        told = f'mount_control: {name} from {before[name]} to {value}'
        assert read_mark(text, 0) == Mark(stamp, 'parameter', told)
    assert control.judge().figures['damper'] == values.get('damper', 'viscous_2000')


@pytest.mark.parametrize('at_work', [False, True])
@pytest.mark.parametrize(
    ('name', 'value', 'reason'),
    [
        ('switching', 'nonsense', "switching 'nonsense' is unknown; known are enabled, always"),
        ('damper', 'nonsense', "no damper curve is called 'nonsense'; known are viscous_1000"),
        ('switch_off_level', 0.005, 'switch_off_level (5 mm) must lie below switch_on_level (0.8 mm)'),
        ('eigenfrequency', 20.0, 'lead_time (7 ms) must stay below an eighth of a period (6.25 ms at 20 Hz)'),
        (
            'displacement_range',
            0.01,
            'displacement_range can be set before configure: deactivate and clean up',
        ),
        ('friction.scale', 1.1, 'friction.scale can be set before configure: deactivate and clean up first'),
        ('policy', 'viscous_example', 'policy can be set before configure: deactivate and clean up first'),
    ],
)
def test_what_cannot_be_set_is_refused_with_the_reason_and_changes_nothing(
    configured, around, at_work, name, value, reason
):
    control = configured(lead_time=0.007)
    if at_work:
        around.initialise()
        assert control.trigger_activate() == SUCCESS
    before = control.get_parameter(name).value
    (told,) = _set(control, **{name: value})
    assert reason in told
    assert control.get_parameter(name).value == before


@pytest.fixture
def shadow(active, around):
    """A controller beside electronics of a law of their own, which have loaded its table."""
    around.add_law()
    control = active(shadow=True)
    currents, forces, offset = TABLE_ROWS
    assert around.law_tables == [[(offset, 0.0), *zip(currents, forces, strict=True)]]
    return control


@pytest.mark.parametrize('electronics_first', [True, False])
def test_one_bit_of_difference_to_the_electronics_is_an_error_that_stays(shadow, around, electronics_first):
    displacement = sine(8.0, 1e-3, 0.4)
    settings = control_settings(PAPER, default_specimen())
    core = Controller(ControlLaw(settings, settings.table(*TABLE_ROWS)))
    core.restart(displacement[0])
    currents = core.run(displacement)['current'].tolist()
    currents[350] = math.nextafter(currents[350], 3.0)
    for number, current in enumerate(currents, 1):
        if electronics_first:
            around.send_electronics(number, current)
        around.send(number, displacement[number - 1])
        _answers(around, number)
        if not electronics_first:
            around.send_electronics(number, current)
        wait_until(lambda count=number: shadow._shadow.compared == count, 'the comparison')
        assert shadow.judge().level is (Level.OK if number <= 350 else Level.ERROR)
    own = math.nextafter(currents[350], 0.0)
    assert (
        f'electronics ({currents[350]!r} A) differs from that of mount_control ({own!r} A)' in shadow.sentence
    )
    assert 'for the sample of 5.351 s' in shadow.sentence
    assert shadow.judge().figures['shadow_different'] == 1


def test_missing_setpoints_of_the_electronics_are_reported(shadow, around):
    for ms in range(1, 31):
        around.send(ms)
        _answers(around, ms)
        if ms < 6:
            around.send_electronics(ms, 0.0)
    wait_until(lambda: shadow._shadow.compared == 5, 'comparison')
    verdict = shadow.judge()
    assert verdict.level is Level.WARN
    assert verdict.sentence.startswith('4 setpoints of the electronics were missing or 20 ms late')
    assert verdict.figures['shadow_missing'] == 4


def test_without_a_table_in_the_electronics_there_is_no_activation(configured, around, monkeypatch):
    monkeypatch.setattr('mount_control.node._LOADING', 0.1)
    monkeypatch.setattr(around, 'send_electronics', lambda *arguments, **options: None)
    around.add_law()
    control = configured(shadow=True)
    around.initialise()
    assert control.trigger_activate() == FAILURE
    assert control.sentence.startswith('the electronics have not loaded the table of their law within 0.1 s')


def test_an_end_takes_the_table_from_the_electronics(shadow, around):
    assert shadow.trigger_deactivate() == SUCCESS
    wait_until(lambda: around.law_tables[-1] == [], 'an empty table')
