"""The control to which a recorded drive is played, as the arguments of `replay.launch.py` order it."""

from dataclasses import replace
from pathlib import Path

from engine_mount.recordings.place import open_run, recording_place
from engine_mount.recordings.recording import Recording
from engine_mount.recordings.session import recorded_session, session_content, session_parameters
from mount_bringup.chosen import chosen_control, with_recorded_policy
from mount_bringup.graph.domain import chosen_domain
from mount_bringup.graph.launch_arguments import COMMON_ARGUMENTS, LaunchArgument
from mount_bringup.graph.nodes import CONTROL, RECORDER, REPLAYED, GraphSettings
from mount_bringup.graph.order import (
    LaunchOrder,
    Settings,
    Texts,
    check_damper,
    is_recorded,
    known_parameters,
    number_of,
    of_file_and_arguments,
    process_settings,
)
from mount_bringup.graph.player import PLAYED
from mount_bringup.settings import SettingError, checked_settings
from mount_control.settings import FRICTION
from mount_models.specimen_choice import SpecimenChoice

_HIGHEST_RATE = 10.0  # chosen
_OF_REPLAY = ('config', 'record', 'recording', 'priority', 'log_level')
_AS_RECORDED = ('policy', 'damper', 'parameters_file', 'specimen')

REPLAY_ARGUMENTS = (
    LaunchArgument('bag', 'recorded drive that is played to the control: its folder; must be given'),
    LaunchArgument(
        'namespace',
        'mount of the recorded drive, and where it is replayed, such as mount_right; empty: its only one',
    ),
    LaunchArgument('rate', 'how fast it is played; 1: as fast as it was recorded', default='1'),
    *(argument for argument in COMMON_ARGUMENTS if argument.name in _OF_REPLAY),
    *(
        argument._replace(meaning=f'{argument.meaning.partition("; empty:")[0]}; empty: as recorded')
        for argument in COMMON_ARGUMENTS
        if argument.name in _AS_RECORDED
    ),
)
"""The arguments of a replay."""


def replay_order(given: Texts) -> LaunchOrder:
    """Return the graph of a replay; a `ValueError` says what cannot be."""
    if not given['bag']:
        raise SettingError('a replay needs a recorded drive: bag:=bags/first')
    records = is_recorded(given)
    recording = _of_mount(open_run(Path(given['bag'])), given['namespace'].strip('/'))
    nodes = tuple(node for node in REPLAYED if records or node is not RECORDER)
    known = known_parameters(nodes)
    settings = _settings(recording, given, known)
    check_damper(given['damper'], settings)
    chosen_control(settings)
    rate = number_of('rate', given['rate'], _HIGHEST_RATE)
    if rate == 0.0:
        raise SettingError(f'rate:={given["rate"]} must be above 0')
    return LaunchOrder(
        nodes=tuple(replace(node, needs=()) for node in nodes),  # the player brings the topics
        settings=GraphSettings(
            namespace=recording.mount,
            domain=chosen_domain(None),
            parameters={node.name: settings.get(node.name, {}) for node in nodes},
            restart_limit=0,  # a replay in which a node failed is no evidence
            **process_settings(given),
        ),
        scenario='replay',
        bag=recording_place(Path(given['bag'])).absolute(),
        rate=rate,
    )


def _of_mount(recording: Recording, namespace: str) -> Recording:
    mounts = recording.mounts
    if not mounts:
        raise SettingError(f'{recording.path} holds no displacement; it has {", ".join(recording.topics)}')
    if not namespace and len(mounts) == 1:
        [namespace] = mounts
    if namespace not in mounts:
        known = ', '.join(mount or '(none)' for mount in mounts)
        raise SettingError(
            f'{recording.path} holds the mounts {known}: choose one of them as namespace; '
            f'instead received {namespace!r}'
        )
    own = recording.of_mount(namespace)
    space = f'/{namespace}'.rstrip('/')
    for topic in PLAYED:
        name = f'{space}/{topic.name}'
        if name not in own.topics or not own.topics[name].message_count:
            raise SettingError(f'{recording.path} holds no {name}, without which the control answers nothing')
    return own


def _settings(recording: Recording, given: Texts, known: Settings) -> Settings:
    """Return the checked settings: as recorded, where neither the file nor an argument says other."""
    own = of_file_and_arguments(REPLAY_ARGUMENTS, given, known, recording.mount)
    control = own.setdefault(CONTROL.name, {})
    recorded = with_recorded_policy(session_parameters(session_content(recorded_session(recording))))
    kept = {name: value for name, value in recorded[CONTROL.name].items() if name in known[CONTROL.name]}
    if 'parameters_file' in control:
        ours = tuple(f'{prefix}.' for prefix in FRICTION)
        kept = {name: value for name, value in kept.items() if not name.startswith(ours)}
    for name in SpecimenChoice._fields:
        kept.pop(name, None)  # the values that these chose are recorded themselves
    return checked_settings({**own, CONTROL.name: kept | control}, known)
