"""Parameter sets as node parameters: what is declared, what is read, what is refused."""

from typing import Annotated, NamedTuple

import pytest
from rclpy.node import Node
from rclpy.parameter import Parameter

from mount_models.quantity import ParameterError, Quantity
from mount_ros.nodes.parameters import ParameterNode, SpecimenValues, declare, read


class Spring(NamedTuple):
    stiffness: Annotated[float, Quantity('N/m', 'how stiff it is', 1.0, 1e6, 'chosen')] = 1e3


class Settings(NamedTuple):
    level: Annotated[float, Quantity('m', 'when to act', 0.001, 0.01, 'section 6')] = 0.002
    count: Annotated[int, Quantity('1', 'how often', 1, 9)] = 3
    open_ended: Annotated[float, Quantity('s', 'any time', 0.0)] = 5.0
    name: Annotated[str, Quantity('word', 'which one', words=('first', 'second'))] = 'first'
    spring: Spring = Spring()


class Marks(NamedTuple):
    marks: Annotated[tuple[str, ...], Quantity('words', 'what is marked')] = ()


@pytest.fixture
def make_subject(make_node):
    def make(*prefix, **overrides):
        node = make_node(Node, 'subject', **overrides)
        declare(node, Settings(), *prefix)
        return node

    return make


def test_defaults_are_read_back_as_they_were_declared(make_subject):
    assert read(make_subject(), Settings()) == Settings()


def test_given_values_are_read_in_nested_sets_too(make_subject):
    node = make_subject(level=0.003, count=5, name='second', **{'spring.stiffness': 20.0})
    assert read(node, Settings()) == Settings(0.003, 5, 5.0, 'second', Spring(20.0))


def test_unit_sentence_source_and_range_travel_with_the_parameter(make_subject):
    node = make_subject()
    level = node.describe_parameter('level')
    assert level.description == 'when to act [m]; section 6'
    bounds = level.floating_point_range[0]
    assert (bounds.from_value, bounds.to_value) == (0.001, 0.01)
    bounds = node.describe_parameter('count').integer_range[0]
    assert (bounds.from_value, bounds.to_value) == (1, 9)
    nested = node.describe_parameter('spring.stiffness').floating_point_range[0]
    assert (nested.from_value, nested.to_value) == (1.0, 1e6)


def test_limits_that_are_no_range_of_ros_are_told_in_words(make_subject):
    node = make_subject()
    assert not node.describe_parameter('open_ended').floating_point_range
    assert node.describe_parameter('open_ended').additional_constraints == '0 .. inf s'
    name = node.describe_parameter('name')
    assert (name.description, name.additional_constraints) == (
        'which one [word]; chosen',
        'first, second word',
    )


@pytest.mark.parametrize('value', [-1.0, float('nan')])
def test_what_ros_lets_through_is_refused_when_it_is_read_and_the_node_is_named(make_subject, value):
    node = make_subject(open_ended=value)
    with pytest.raises(ParameterError, match=r'^open_ended \(.* s\) must lie within 0 \.\. inf s'):
        read(node, Settings())


def test_a_number_that_may_be_unknown_may_be_nan_and_no_other(context):
    class Measured(NamedTuple):
        celsius: Annotated[float, Quantity('degC', 'how warm', -60, 250, may_be_unknown=True)] = float('nan')

    for value, refused in ((None, False), (25.0, False), (float('nan'), False), (300.0, True)):
        overrides = [] if value is None else [Parameter('celsius', value=value)]
        node = Node('subject', context=context, parameter_overrides=overrides)
        declare(node, Measured())
        if refused:
            with pytest.raises(
                ParameterError, match=r'celsius \(300 degC\) must lie within -60 \.\. 250 degC'
            ):
                read(node, Measured())
        else:
            assert str(read(node, Measured()).celsius) == str(float('nan') if value is None else value)
        described = node.describe_parameter('celsius')
        assert described.additional_constraints == '-60 .. 250 degC, or nan: unknown'
        node.destroy_node()


# What is set on a node of the graph.


@pytest.fixture
def make_declaring(make_node):
    def make(**overrides):
        node = make_node(ParameterNode, 'subject', **overrides)
        declare(node, Settings())
        declare(node, Marks())
        return node

    return make


def test_a_whole_number_becomes_the_float_that_is_declared(make_declaring):
    node = make_declaring(open_ended=7)
    assert read(node, Settings()).open_ended == 7.0
    assert node.set_parameters([Parameter('open_ended', value=8)])[0].successful
    assert node.set_parameters_atomically([Parameter('open_ended', value=9)]).successful
    assert read(node, Settings()).open_ended == 9.0
    assert not node.set_parameters([Parameter('level', value=1)])[0].successful  # beyond its range


@pytest.mark.parametrize('text', ['5e-05', '1E3', 'nan'])
def test_the_text_of_a_float_is_one_as_ros2_param_load_hands_it_on(make_declaring, text):
    node = make_declaring()
    assert node.set_parameters([Parameter('open_ended', value=text)])[0].successful
    assert repr(node.get_parameter('open_ended').value) == repr(float(text))
    assert node.set_parameters([Parameter('name', value=text)])[0].successful
    assert node.get_parameter('name').value == text


@pytest.mark.parametrize('kind', [Parameter.Type.STRING_ARRAY, Parameter.Type.BOOL_ARRAY])
def test_a_list_of_texts_can_be_emptied_whatever_ros_takes_an_empty_list_for(make_declaring, kind):
    node = make_declaring(marks=['a', 'b'])
    assert node.describe_parameter('marks').description == 'what is marked [words]; chosen'
    assert node.set_parameters([Parameter('marks', kind, [])])[0].successful
    assert node.get_parameter('marks').value == []


@pytest.mark.parametrize('atomically', [True, False])
def test_what_does_not_fit_is_refused_in_words(make_declaring, atomically):
    node = make_declaring()

    def refusal(name, value):
        parameters = [Parameter(name, value=value)]
        result = (
            node.set_parameters_atomically(parameters) if atomically else node.set_parameters(parameters)[0]
        )
        assert not result.successful
        return result.reason

    assert refusal('cuont', 3) == "'cuont' is no parameter of subject; did you mean count?"
    assert refusal('level', 'high') == "Wrong parameter type, expected 'Type.DOUBLE' got 'Type.STRING'"
    assert 'out of range' in refusal('level', 0.02)
    assert 'out of range' in refusal('count', 0)
    assert refusal('count', 2.5) == "Wrong parameter type, expected 'Type.INTEGER' got 'Type.DOUBLE'"
    assert read(node, Settings()) == Settings()


# Values of a file.


def test_a_file_gives_values_where_nobody_set_them(make_subject):
    node = make_subject(level=0.002)  # set to its default on purpose
    SpecimenValues(node).give(Settings(), '', {'level': 0.004, 'count': 7, 'spring.stiffness': 9.0, 'x': 1.0})
    assert read(node, Settings()) == Settings(0.002, 7, 5.0, 'first', Spring(9.0))


def test_what_was_changed_after_a_file_stays_and_the_rest_follows_the_next_file(make_subject):
    node = make_subject('plant')
    values = SpecimenValues(node)
    values.give(Settings(), 'plant', {'level': 0.004, 'count': 7, 'open_ended': 1.0})
    node.set_parameters([Parameter('plant.level', value=0.005)])
    values.give(Settings(), 'plant', {'level': 0.006, 'count': 8})
    assert read(node, Settings(), 'plant') == Settings(0.005, 8)


def test_a_value_that_the_parameter_refuses_is_told(make_subject):
    with pytest.raises(ParameterError, match=r'subject: .*level'):
        SpecimenValues(make_subject()).give(Settings(), '', {'level': 0.5})
