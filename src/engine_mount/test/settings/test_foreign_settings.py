"""Whatever a user sets, in a file, an option, a session or at run time: it is within its range or refused."""

import contextlib
import math
import random

import yaml
from hypothesis import given
from hypothesis import strategies as st
from ros_testing import mutated

from engine_mount.recordings.session import SessionError, session_content, session_sample_rate
from engine_mount.settings.options import settings_of_mounts, settings_of_options
from mount_bringup.parameter_file import settings_in
from mount_bringup.settings import checked_settings, defaults_of_nodes
from mount_control.settings import check_policies, control_settings, defaults
from mount_driver.parameters import DriverParameters
from mount_init.parameters import InitParameters
from mount_models.plain_yaml import YamlError, plain_yaml
from mount_models.quantity import LawRefusedError, ParameterError, quantities, with_flattened
from mount_models.sampling import HIGHEST_SAMPLE_RATE, LOWEST_SAMPLE_RATE
from mount_models.specimen import SpecimenError, default_specimen
from mount_sim.parameters import SimParameters

REFUSALS = (YamlError, ParameterError, SpecimenError, LawRefusedError)
SEEDS = st.integers(0, 1 << 62)
KNOWN = defaults_of_nodes()
SETS = {
    'mount_driver': DriverParameters(),
    'mount_init': InitParameters(),
    'mount_sim': SimParameters(),
}
HARD = [
    '.nan', '.inf', '-.inf', '1e999', '-1', '0', '1e-320', '3.5', '0x7f', '1_0', '0o17', '1:30',
    'true', 'null', '""', '[]', '{}', '[1, 2]', '{a: 1}', '&a 1', '*a', '!!int 3', '2026-05-04',
    '"\\0"', '9999999999999999999999999999999999999999', '1e9e9e9', 'on', '<<', '-5e-324',
    '179769313486231570000e290',
]  # fmt: skip


def as_text(settings):
    nodes = {f'/**/{node}': {'ros__parameters': dict(values)} for node, values in settings.items()}
    return yaml.safe_dump(nodes, sort_keys=False)


def plain_values(values):
    return {name: list(value) if isinstance(value, tuple) else value for name, value in values.items()}


NODES, LINES = zip(
    *(
        (node, line)
        for node in KNOWN
        for line in as_text({node: plain_values(KNOWN[node])}).splitlines()
        if ': ' in line
    ),
    strict=True,
)


def changed_file(seed):
    """Return a parameter file of one value, which is a hard one, or some bytes are changed."""
    draw = random.Random(seed)
    place = draw.randrange(len(LINES))
    head, line = f'/**/{NODES[place]}:\n  ros__parameters:\n', LINES[place]
    if draw.random() < 0.7:
        return f'{head}{line.partition(":")[0]}: {draw.choice(HARD)}'
    return mutated((head + line).encode(), seed).decode(errors='replace')


def assert_within(parameters):
    """Every number of a set is finite and within its range; NaN only where it may be unknown."""
    for name, value in parameters._asdict().items():
        if hasattr(value, '_asdict'):
            assert_within(value)
        elif isinstance(value, (int, float)) and name in quantities(parameters):
            note = quantities(parameters)[name]
            assert (note.may_be_unknown and math.isnan(value)) or note.low <= value <= note.high, name


def assert_sound(settings):
    for mount in settings_of_mounts(settings).values():
        for node, values in mount.items():
            if node in SETS:
                assert_within(with_flattened(SETS[node], values))
            if node == 'mount_control':
                assert_within(control_settings({**defaults(), **values}, SPECIMEN).parameters)


SPECIMEN = default_specimen()


@given(SEEDS)
def test_a_changed_parameter_file_is_refused_or_every_value_is_within_its_range(seed):
    with contextlib.suppress(*REFUSALS):
        assert_sound(checked_settings(settings_in(plain_yaml(changed_file(seed)), 'car.yaml', '', KNOWN)))


@given(SEEDS)
def test_a_changed_option_is_refused_or_within_its_range(seed):
    draw = random.Random(seed)
    place = draw.randrange(len(LINES))
    name, _, value = LINES[place].strip().partition(': ')
    option = f'{NODES[place]}.{name}={draw.choice([*HARD, value])}'
    if draw.random() < 0.3:
        option = mutated(option.encode(), seed).decode(errors='replace')
    with contextlib.suppress(*REFUSALS):
        assert_sound(checked_settings(settings_of_options([option])))


SESSION = """format: 1
scenario: motorway
parameters: {mount_control: {sample_rate: 1000.0, policy: continuous_viscous}}
"""


@given(SEEDS)
def test_a_changed_session_is_refused_or_gives_a_sample_rate_within_its_range(seed):
    draw = random.Random(seed)
    text = SESSION.replace('1000.0', draw.choice(HARD)) if draw.random() < 0.3 else SESSION
    text = mutated(text.encode(), seed).decode(errors='replace')
    with contextlib.suppress(SessionError):
        assert LOWEST_SAMPLE_RATE <= session_sample_rate(session_content(text)) <= HIGHEST_SAMPLE_RATE


@given(SEEDS)
def test_a_changed_value_at_run_time_is_refused_or_leaves_a_sound_controller(seed):
    draw = random.Random(seed)
    values = defaults()
    for name in draw.sample(sorted(values), draw.choice((1, 1, 2))):
        kind = type(values[name])  # ROS itself holds to it
        if kind in AT_RUN_TIME:
            values[name] = draw.choice(AT_RUN_TIME[kind])
    with contextlib.suppress(*REFUSALS):
        check_policies(values)
        settings = control_settings(values, SPECIMEN)
        assert_within(settings.parameters)
        assert_within(settings.friction)
        assert_within(settings.contact)
        for number in settings.design if isinstance(settings.design, tuple) else ():
            assert not isinstance(number, float) or math.isfinite(number)


AT_RUN_TIME = {
    float: (
        *(math.nan, math.inf, -math.inf, 0.0, -0.0, -1.0, 5e-324, 1e308, 0.5, 1.0, 8.0, 1e-3, 49.9, 1000.0),
    ),
    int: (0, 1, -1, 3, 1 << 62, -(1 << 63)),
    bool: (True, False),
    str: (
        'viscous_1e9', 'continuous_viscous', 'nan', '../x.csv', '', '{law: viscous}', '\x00',
    ),
}  # fmt: skip
