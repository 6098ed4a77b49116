"""A recorded drive that is to be played to a control, as the arguments of `replay.launch.py` order it."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from engine_mount.recordings.bag.recording import Recording
from engine_mount.recordings.run.place import open_run, recording_place
from engine_mount.recordings.run.session import recorded_session, session_content, session_parameters
from mount_bringup.chosen import chosen_control, with_recorded_policy
from mount_bringup.graph.domain import chosen_domain
from mount_bringup.graph.launch_arguments import REPLAY_ARGUMENTS
from mount_bringup.graph.nodes import CONTROL, RECORDER, REPLAYED, GraphSettings
from mount_bringup.graph.order import LaunchOrder, check_damper, known_parameters, number_of, of_arguments
from mount_bringup.graph.player import PLAYED
from mount_bringup.parameter_file import settings_of_file
from mount_bringup.settings import SettingError, checked_settings
from mount_control.settings import FRICTION
from mount_models.specimen_choice import SpecimenChoice
from mount_ros.nodes.real_time import HIGHEST

_HIGHEST_RATE = 10.0  # chosen


def replay_order(given: Mapping[str, str]) -> LaunchOrder:
    """Return the graph for the texts `given`, {argument: text}; a `ValueError` says what cannot be."""
    if not given['bag']:
        raise SettingError('a replay needs a recorded drive: bag:=bags/first')
    records = given['record'] == 'true'
    if records and not given['recording']:
        raise SettingError('a recording needs a folder: recording:=bags/again; or record:=false')
    recording = _of_mount(open_run(Path(given['bag'])), given['namespace'].strip('/'))
    nodes = tuple(node for node in REPLAYED if records or node is not RECORDER)
    names = [node.name for node in nodes]
    known = {name: values for name, values in known_parameters().items() if name in names}
    settings = _settings(recording, given, known)
    check_damper(given['damper'], settings)
    chosen_control(settings)
    return LaunchOrder(
        nodes=nodes,
        settings=GraphSettings(
            namespace=recording.mount,
            domain=chosen_domain(None),
            parameters={name: settings.get(name, {}) for name in names},
            priority=number_of('priority', given['priority'], HIGHEST, int),
            restart_limit=0,  # a replay that a node has left is no evidence
        ),
        scenario='replay',
        duration=float('inf'),
        log_level=given['log_level'],
        bag=recording_place(Path(given['bag'])).absolute(),
        rate=_rate(given['rate']),
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


def _settings(
    recording: Recording, given: Mapping[str, str], known: Mapping[str, Mapping[str, Any]]
) -> dict[str, dict[str, Any]]:
    """Return the checked settings: as recorded, where neither the file nor an argument says other."""
    file = Path(given['config']) if given['config'] else None
    own: dict[str, dict[str, Any]] = {name: {} for name in known}
    for layer in (
        settings_of_file(file, recording.mount, known) if file else {},
        of_arguments(REPLAY_ARGUMENTS, given),
    ):
        for name in known:
            own[name].update(layer.get(name, {}))
    recorded = with_recorded_policy(session_parameters(session_content(recorded_session(recording))))
    kept = {name: value for name, value in recorded[CONTROL.name].items() if name in known[CONTROL.name]}
    if 'parameters_file' in own[CONTROL.name]:
        ours = tuple(f'{prefix}.' for prefix in FRICTION)
        kept = {name: value for name, value in kept.items() if not name.startswith(ours)}
    for name in SpecimenChoice._fields:
        kept.pop(name, None)  # what they said is among the recorded values
    own[CONTROL.name] = kept | own[CONTROL.name]
    return checked_settings(own, known)


def _rate(text: str) -> float:
    rate: float = number_of('rate', text, _HIGHEST_RATE, float)
    if rate == 0.0:
        raise SettingError(f'rate:={text} must be above 0')
    return rate
