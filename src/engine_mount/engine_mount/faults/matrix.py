"""The requirements: every fault with what the graph must do about it."""

import math
from signal import SIGINT

from lifecycle_msgs.msg import Transition

from engine_mount.faults.fault import FaultCase, Reaction
from engine_mount.faults.injections import (
    ClockStep,
    ControlHangs,
    Intruder,
    Killed,
    ParametersSet,
    Simulated,
    Stopped,
    Transitioned,
    Unchanged,
)
from mount_sim.electronics.faults.kinds import FAULTS

_TOLERATED, _TOLD = Reaction.TOLERATED, Reaction.TOLD
_WHILE, _INITIALISE = Reaction.SAFE_WHILE, Reaction.SAFE_UNTIL_INITIALISED
_CONFIGURE, _CLEANUP = Transition.TRANSITION_CONFIGURE, Transition.TRANSITION_CLEANUP
ACTIVATE, DEACTIVATE = Transition.TRANSITION_ACTIVATE, Transition.TRANSITION_DEACTIVATE
_ANOTHER = (
    'another|a second |second sender|publisher|writer'  # words that name who sends what only one may send
)
_SILENCE = 'no frames|no displacement|no setpoint'
_HOUR = 3600.0  # s


def _simulated(name: str, reaction: Reaction, words: str = '', **options) -> FaultCase:
    return FaultCase(name, FAULTS[name].meaning, Simulated(name), reaction, words, **options)


def _at_start(name: str, words: str, **options) -> FaultCase:
    """A fault that is there from the first sample on, so that the initialisation must find it."""
    told = ('--set', f'mount_sim.faults=["{name}@0"]')
    meaning = f'{FAULTS[name].meaning}, from the start'
    return FaultCase(
        f'{name}_at_start',
        meaning,
        Unchanged(),
        Reaction.NOT_STARTED,
        words,
        options=told,
        ends_drive=True,
        **options,
    )


def _from_start(name: str, lasts: float, faults: str = '"clock_drift@0", "counter_wrap@8"') -> FaultCase:
    """A fault that is there during the whole run, and that must be tolerated."""
    told = ('--set', f'mount_sim.faults=[{faults}]')
    return FaultCase(name, FAULTS[name].meaning, Unchanged(), _TOLERATED, lasts=lasts, options=told)


def _off(name: str, words: str, **options) -> FaultCase:
    """A fault of the coil or its supply: the drive ends."""
    return _simulated(name, _INITIALISE, words, ends_drive=True, **options)


def _sender(name: str, meaning: str, kind: str, **options) -> FaultCase:
    """Another sender of what only one may send: a node leaves the graph at 0 A, one on the bus ends it."""
    return FaultCase(name, meaning, Intruder(kind), _INITIALISE, _ANOTHER, 1.0, **options)


def _flood(name: str, meaning: str, kind: str) -> FaultCase:
    return FaultCase(name, meaning, Intruder(kind), _TOLERATED, lasts=1.0)


def _stopped(node: str, name: str, lasts: float, reaction: Reaction, words: str = '', **options) -> FaultCase:
    """A process stands still for a while (SIGSTOP)."""
    meaning, injection = f'mount_{node} stands still for {lasts:g} s', Stopped(f'mount_{node}')
    return FaultCase(f'stop_{node}_{name}', meaning, injection, reaction, words, lasts, **options)


def _hanging(name: str, *options: str) -> FaultCase:
    """A step of the control does not come to its end for a while; `options` of the graph."""
    meaning = f'a control step lasts 0.5 s{" in a composed graph" if options else ""}'
    injection = ControlHangs(0.5)
    rest = {'silent': True, 'options': options, 'shim': True, 'third': True}
    return FaultCase(name, meaning, injection, _WHILE, 'no setpoint', lasts=0.4, **rest)


def _lost(node: str, reaction: Reaction, **options) -> FaultCase:
    """A process ends by SIGKILL."""
    name = f'mount_{node}'
    return FaultCase(f'kill_{node}', f'SIGKILL of {name}', Killed(name), reaction, name, **options)


BUS = (
    _simulated('can_silent', _WHILE, _SILENCE, silent=True, third=True),
    _simulated('bus_off', _WHILE, 'bus off', silent=True, in_electronics=True),
    _simulated('lost_1', _TOLERATED, 'samples lost'),
    _simulated('lost_5', _TOLD, 'samples lost', lasts=1.5, third=True),
    _simulated('lost_50', _TOLD, 'samples lost', lasts=1.5),
    _simulated('delayed', _TOLERATED, third=True),
    _simulated('delayed_50', _WHILE, 'do not take|late|old', in_electronics=True, lasts=1.5),
    _simulated('duplicated', _TOLERATED, 'repeated', lasts=1.0, third=True),
    _simulated('reordered', _TOLD, 'wrong sequence|samples lost', lasts=1.0),
    _off('frozen_counter', 'second sender', silent=True, third=True),
    _simulated('wrong_crc', _TOLD, 'corrupt', lasts=1.0, third=True),
    _simulated('wrong_length', _TOLD, 'corrupt', lasts=1.0),
    _off('replayed', 'another|second sender'),
    _simulated('babbling', _TOLERATED, third=True),
    _simulated('deaf', _WHILE, 'do not take the setpoints', in_electronics=True, lasts=1.5),
)
CLOCKS = (
    _simulated('clock_jump', _INITIALISE, 'restart|clock|initialis'),
    _from_start('clock_drift', lasts=2.0),
    _from_start('counter_wrap', lasts=6.0),
    _simulated('electronics_reset', _INITIALISE, 'restart|initialis', silent=True, third=True),
    FaultCase(
        'clock_forward', 'the system clock goes an hour ahead', ClockStep(_HOUR), _TOLERATED, shim=True
    ),
    FaultCase(
        'clock_back', 'the system clock goes back by an hour', ClockStep(-_HOUR), _TOLERATED, shim=True
    ),
)
SENSORS = (
    _simulated('displacement_invalid', _WHILE, 'displacement', third=True),
    _simulated('displacement_stuck', _WHILE, 'displacement', lasts=1.5),
    _simulated('displacement_step', _WHILE, 'displacement'),
    _simulated('displacement_out_of_range', _WHILE, 'displacement|invalid', third=True),
    _simulated('displacement_noisy', _WHILE, 'noise of the displacement|displacement moved'),
    # Nothing shows a sign that is wrong from the start, and the damping stays what it is; a jump does show.
    _from_start('displacement_inverted', 2.0, '"displacement_inverted@0"'),
    _simulated('displacement_flipped', _TOLD, 'displacement moved', third=True),
    _simulated('displacement_drifting', _TOLERATED, lasts=1.5, third=True),
    _simulated('displacement_sensor', _WHILE, 'fault of the displacement sensor', third=True),
    _off('ripple_missing', 'ripple'),
    _off('ripple_noisy', 'ripple'),
    _off('ripple_scale', 'ripple'),
    _at_start('ripple_missing', 'ripple'),
    _at_start('ripple_noisy', 'ripple|gap'),
    _at_start('ripple_scale', 'ripple|gap|contact'),
)
COIL = (
    _off('coil_open', 'coil current', third=True),
    _off('coil_half', 'coil current'),
    _off('coil_stuck', 'coil current', coil_apart=True),
    _off('coil_stuck_on', 'coil current', coil_apart=True),
    _off('coil_shorted', 'coil'),
    _simulated('coil_hot', _TOLD, 'coil temperature'),
    _off('supply_0', 'supply'),
    _off('supply_5', 'supply', third=True),
    _simulated('supply_9', _TOLERATED),
    _simulated('supply_16', _TOLERATED, third=True),
    _off('supply_24', 'supply'),
    _off('over_current', 'over_current'),
    _off('over_temperature', 'over_temperature'),
    _off('under_voltage', 'under_voltage'),
    _off('temperature_250', 'coil temperature'),
    _off('pads_missing', 'pads'),
    _off('gap_blocked', 'gap|pads'),
    _at_start('coil_shorted', 'resistance|ohm|coil'),
    _at_start('pads_worn', 'gap|pads'),
    _at_start('pads_missing', 'gap|pads|contact'),
    _at_start('gap_blocked', 'gap|contact|closed', third=True),
)
SENDERS = (
    _sender(
        'second_host',
        'a second CAN host asks for 3 A',
        'can_host',
        third=True,
        in_electronics=True,
        ends_drive=True,
    ),
    _sender(
        'second_electronics', 'second electronics send samples at rest', 'can_electronics', ends_drive=True
    ),
    _sender(
        'second_setpoint', 'a second node publishes 3 A on current_setpoint', 'current_setpoint', third=True
    ),
    _sender('second_displacement', 'a second node publishes on displacement', 'displacement'),
    _sender('second_air_gap', 'a second node publishes on air_gap', 'air_gap'),
    _sender('second_table', 'a second node publishes on current_force_table', 'table'),
    _sender('table_old', 'the same, a table of an older activation', 'table_old'),
    _sender('table_not_monotone', 'the same, a table that falls', 'table_not_monotone'),
    _flood('flood_bus', '1000 datagrams a second on the bus that are no frames', 'can_garbage'),
    _flood('flood_topic', '5000 events a second', 'flood_topic'),
    _flood('flood_service', 'mount_control is asked for parameters 500 times a second', 'flood_service'),
)
PROCESSES = (
    _hanging('hang_control'),
    _hanging('hang_control_composed', '--composed'),
    _stopped('control', '200_ms', 0.2, _WHILE, 'no setpoint', silent=True, third=True),
    _stopped('control', '2_s', 2.0, _INITIALISE, 'no setpoint', silent=True),
    _stopped('driver', '200_ms', 0.2, _WHILE, 'no displacement|no setpoint|not take', in_electronics=True),
    _stopped('driver', '2_s', 2.0, _WHILE, 'no displacement|no samples', in_electronics=True),
    _stopped('recorder', '200_ms', 0.2, _TOLERATED),
    _stopped('recorder', '2_s', 2.0, _TOLERATED, third=True),
    _stopped('sim', '200_ms', 0.2, _WHILE, _SILENCE, silent=True, coil_apart=True),
    _stopped('sim', '2_s', 2.0, _WHILE, _SILENCE, silent=True, coil_apart=True),
    _lost('control', _WHILE, silent=True, third=True),
    _lost('driver', _INITIALISE, silent=True, in_electronics=True, third=True),
    _lost('init', _TOLD),
    _lost('recorder', _TOLD, loses_samples=True),
    _lost('sim', _INITIALISE, silent=True, ends_drive=True, coil_apart=True),
    FaultCase(
        'kill_supervisor', 'SIGKILL of the supervisor', Killed('supervisor'), _INITIALISE,
        'started this one .* has ended', ends_drive=True,
    ),
    FaultCase(
        'interrupt', 'Ctrl-C amid damping', Killed('supervisor', SIGINT), _INITIALISE, 'interrupted',
        ends_drive=True,
    ),
)  # fmt: skip
OPERATION = (
    FaultCase(
        'deactivate', 'mount_control is deactivated amid damping',
        Transitioned((('mount_control', DEACTIVATE),), (('mount_control', ACTIVATE),)),
        _WHILE, 'no setpoint|inactive', silent=True, third=True,
    ),
    FaultCase(
        'table_missing', 'mount_control is activated without a table',
        Transitioned(
            (
                ('mount_control', DEACTIVATE), ('mount_control', _CLEANUP),
                ('mount_init', DEACTIVATE), ('mount_init', _CLEANUP),
                ('mount_control', _CONFIGURE), ('mount_control', ACTIVATE),
            ),
            (('mount_init', _CONFIGURE), ('mount_init', ACTIVATE), ('mount_control', ACTIVATE)),
        ),
        _INITIALISE, 'table',
    ),
    FaultCase(
        'shutdown', 'mount_control is shut down amid damping',
        Transitioned((('mount_control', Transition.TRANSITION_ACTIVE_SHUTDOWN),)),
        _INITIALISE, 'no setpoint|shut', silent=True, for_good=True,
    ),
    FaultCase(
        'nonsense_parameters', 'parameters of all nodes are set to what makes no sense',
        ParametersSet((
            ('mount_control', 'continuous_viscous.damping_coefficient', -3.0),
            ('mount_control', 'continuous_viscous.damping_coefficient', math.nan),
            ('mount_control', 'damper', 'nonsense'),
            ('mount_driver', 'setpoint_timeout', 5.0),
            ('mount_init', 'silence_timeout', -1.0),
            ('mount_sim', 'inject', 'nonsense'),
            ('mount_recorder', 'uri', '/'),
        )),
        Reaction.REFUSED, third=True,
    ),
)  # fmt: skip
MATRIX = {case.name: case for case in (*BUS, *CLOCKS, *SENSORS, *COIL, *SENDERS, *PROCESSES, *OPERATION)}
"""{name: fault}."""
