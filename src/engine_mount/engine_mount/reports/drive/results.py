"""What a recorded drive ends with: figures (those of `--json`, and the same for people), picture and page."""

import contextlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from engine_mount.recordings.access import audit
from engine_mount.recordings.difference import known
from engine_mount.recordings.events import Switching, switching_times
from engine_mount.recordings.losses import Losses
from engine_mount.recordings.recording import Recording, open_recording
from engine_mount.recordings.screen import Screen, Table
from engine_mount.reports.drive.beside import BesideError, name_of, peaks_text
from engine_mount.reports.drive.felt import ACCELERATIONS, BANDS, felt_beside, value_text
from engine_mount.reports.drive.signals import error_text, excitation_stamp, samples_at_the_ends
from engine_mount.reports.sections.subject import Subject
from engine_mount.settings.chosen import Parameters
from engine_mount.settings.options import mounts_of
from engine_mount.settings.run_folder import RunFolder, write_json
from mount_recorder.folders import recordings_of
from mount_sim.plant.mounts import without_friction

if TYPE_CHECKING:
    from mount_bringup.graph.recovery import Restart  # ROS, which a drive in core does without

Figures = dict[str, Any]

_COMMON = ('scenario', 'mode', 'samples', 'recordings', 'real_time_factor')  # to all mounts of a run
_LATE_CONTROL = 0.5  # s, chosen: so much of the excitation may pass before control answers
_MEASURED = ('rest_gap', 'contact_gap', 'rest_gap_std', 'contact_gap_std')


@dataclass
class DriveResult:
    """Figures, recordings, pictures, and a sentence for each thing that is not as it should be."""

    figures: Figures
    recordings: list[Path]
    complaints: list[str]
    pictures: list[Path] = field(default_factory=list)


def evaluate_drive(
    folder: RunFolder, parameters: Parameters, run: Figures, screen: Screen, *, report: bool
) -> DriveResult:
    """Print and write the figures of a drive, with `report` also its picture and its page.

    `run` is what the run itself knows, `parameters` those of its nodes. Of several mounts each has figures
    under `mounts`, a table and a picture; they share a page. Where the recorder was started again the figures
    are those of the longest recording, and the others are audited. A picture or page that cannot be made is a
    complaint.
    """
    recording, *others = _longest_first(recordings_of(folder.recording))
    places = sorted(entry.path for entry in (recording, *others))
    run = {**run, 'recordings': [str(place) for place in places]}
    result = DriveResult({}, places, list(recording.warnings))
    parts = [recording.of_mount(name) for name in mounts_of(parameters)] or [recording]
    figures = {part.mount: _evaluate_mount(part, run, screen, result) for part in parts}
    several = '' not in figures
    result.figures = {**{name: run[name] for name in _COMMON}, 'mounts': figures} if several else figures['']
    result.complaints += [words for other in others for words in _audited(other, screen)]
    write_json(result.figures, folder.summary)
    if report:
        for part in parts:
            _draw(folder, part, screen, result)
        _make(folder.report, lambda: _write_page(folder, parts, screen), result)
    return result


def _evaluate_mount(recording: Recording, run: Figures, screen: Screen, result: DriveResult) -> Figures:
    """Print the figures of one mount; return them, add to `result` what is wrong."""
    subject = Subject(recording)
    with screen.line('evaluating the recording'):
        figures, found = summarise(subject, run), subject.losses
    mount = f'{recording.mount}: ' if recording.mount else ''
    complaints = [*found.complaints(), *samples_at_the_ends(recording, subject.audit.topics, run['samples'])]
    result.complaints += [f'{mount}{words}' for words in (*complaints, *late_control(figures))]
    screen.table(summary_table(figures, found, mount))
    screen.table(subject.audit.table)
    recording.release()  # of several mounts one is in memory at a time
    return figures


def summarise(subject: Subject, run: Figures) -> Figures:
    """Return the figures of a drive from its recording; `run` brings the others.

    `run`: `scenario`, `mode`, `excitation_start`, `real_time_factor`, `latency_median_s`, `latency_p99_s`,
    `restarts`, `recordings`. Times are s on the recording's time axis. Unknown or not applicable is null.
    """
    recording, figures, beside = subject.recording, subject.figures, subject.beside
    gap, truth = recording['air_gap'], recording['sim/truth']
    start = float(subject.seconds(excitation_stamp(recording, run['excitation_start'])))
    begin = switched_on = switched_off = None  # with a mount without friction
    if not subject.run.without_friction:
        damped = subject['damping']
        begin = float(damped.time[0]) if damped else None
        on, off = switching_times(*damped) if damped else ((), ())
        switched_on, switched_off = list(map(float, on)), list(map(float, off))
    peaks = felt = None
    if not isinstance(beside, str):
        peaks = {name: float(np.max(np.abs(each['displacement']))) for name, each in beside.truths.items()}
        with contextlib.suppress(BesideError):
            mounts = felt_beside(recording, subject.run.parameters, beside)
            felt = {name: {key: known(value) for key, value in each.items()} for name, each in mounts.items()}
    seen = subject['displacement'].time
    return {
        'recording': str(recording.path),
        'recordings': run['recordings'],
        'scenario': run['scenario'],
        'mode': run['mode'],
        'mount': subject.run.mount,
        'excitation_start_s': start,
        'control_from_s': begin,
        'duration_s': float(seen[-1] - max(seen[0], start)),
        **subject.losses.as_json(),
        'restarts': [_restart(entry, subject.zero) for entry in run['restarts']],
        'real_time_factor': run['real_time_factor'],
        **{f'{name}_m': float(gap[name][-1]) for name in _MEASURED},
        **{f'true_{name}_m': float(truth[name][-1]) for name in _MEASURED[:2]},
        'offset_current_a': float(gap['offset_current'][-1]),
        'switch_on_s': switched_on,
        'switch_off_s': switched_off,
        'peak_displacement_m': figures['peak_displacement_m'],
        'beside': peaks,
        'felt': felt,
        'peak_current_a': figures['peak_current_a'],
        'tracking_error_rms': figures['tracking_error_rms'],
        **{name: known(run[name]) for name in ('latency_median_s', 'latency_p99_s')},
    }


def late_control(figures: Mapping[str, Any]) -> list[str]:
    """Return a sentence if control answered its first sample well behind the start of the excitation."""
    if without_friction(figures['mount']):
        return []
    begin, start = figures['control_from_s'], figures['excitation_start_s']
    if begin is None:
        return ['control answered no sample: the mount had no damping; look at its log']
    late = begin - start
    if late <= _LATE_CONTROL:
        return []
    return [
        f'control answered its first sample {late:.1f} s after the excitation began (limit {_LATE_CONTROL:g} '
        's); until then the mount had no damping: drive again if the initialisation was repeated, or give it '
        'more time by mount_sim.timeline.start'
    ]


def summary_table(figures: Figures, found: Losses, mount: str = '') -> Table:
    """Return the figures for people, `mount` before their title; times in s from the first displacement."""
    peaks = {name_of(figures['mount']): figures['peak_displacement_m'], **(figures['beside'] or {})}
    rows = [('peak displacement', peaks_text(peaks))]
    for name in ('rest', 'contact'):
        measured, std, true = (
            1e6 * figures[key] for key in (f'{name}_gap_m', f'{name}_gap_std_m', f'true_{name}_gap_m')
        )
        rows.append((f'{name} gap', f'{measured:.1f} ± {std:.1f} µm measured, {true:.1f} µm true'))
    rows.append(('excitation', f'from {figures["excitation_start_s"]:.2f} s on'))
    reason = without_friction(figures['mount'])
    begin, peak, error = (
        figures[name] for name in ('control_from_s', 'peak_current_a', 'tracking_error_rms')
    )
    if not reason:
        rows.append(('control', 'answered no sample' if begin is None else f'from {begin:.2f} s on'))
    if reason:
        rows.append(('friction', f'not applicable: {reason}'))
    else:
        rows += [
            ('damping switched', Switching(figures['switch_on_s'], figures['switch_off_s']).sentence(2)),
            ('peak current', 'unknown' if peak is None else f'{peak:.2f} A'),
            ('friction force error', 'damping was never on' if error is None else error_text(error)),
        ]
    rows += found.rows()
    for entry in figures['restarts']:
        text = f'{entry["reason"]}; {entry["remedy"]} ({entry["took_s"]:.1f} s)'
        rows.append((f'lost at {entry["time_s"]:.1f} s', text))
    latency, median, p99 = 'none (no middleware)', figures['latency_median_s'], figures['latency_p99_s']
    if median is not None and p99 is not None:
        latency = (
            f'{1e6 * median:.0f} µs median, {1e6 * p99:.0f} µs in 99 of 100 (sample sent to setpoint back)'
        )
    rows += [('latency', latency), ('speed', f'{figures["real_time_factor"]:.2f} x real time')]
    unit = f' mm/s² ({"-".join(f"{low:g}" for low, _ in BANDS)}-{BANDS[-1][1]:g} Hz)'
    for place, (name, felt) in enumerate((figures['felt'] or {}).items()):
        values = ', '.join(value_text(figure, felt[figure]) for figure in ACCELERATIONS[:-1])
        rows.append((f'  {name}', values) if place else ('chassis acceleration', values + unit))
    return Table(f'{mount}{figures["scenario"]}, {figures["mode"]}', 'll', rows)


def _restart(restart: 'Restart', zero: int) -> Figures:
    return {
        'time_s': (restart.time - zero) / 1e9,
        'nodes': [node.name for node in restart.nodes],
        'reason': restart.reason,
        'remedy': restart.action.value,
        'took_s': restart.took,
    }


def _longest_first(places: list[Path]) -> list[Recording]:
    """Return the recordings of a run, that of which its figures are made first."""

    def samples(recording: Recording) -> int:
        names = (f'/{mount}/displacement'.replace('//', '/') for mount in recording.mounts)
        return sum(recording.topics[name].message_count for name in names)

    return sorted(map(open_recording, places), key=samples, reverse=True)


def _audited(recording: Recording, screen: Screen) -> list[str]:
    """Say in one sentence what a recording holds; return what is not as it should be."""
    found, name = audit(recording), recording.path.name
    screen.say(f'{name}: {found.sentences()[-1]}')
    return [*found.warnings, *(f'{name}: {words}' for words in found.losses.complaints())]


def _draw(folder: RunFolder, recording: Recording, screen: Screen, result: DriveResult) -> None:
    file = folder.figure
    if recording.mount:
        file = file.with_name(f'{file.stem}_{recording.mount}{file.suffix}')

    def draw() -> None:
        # after the drive: what draws takes a second to load
        from engine_mount.reports.sections.motion import draw_drive

        draw_drive(Subject(recording), file, file.with_suffix('.svg'))
        result.pictures.append(file)

    with screen.line(f'drawing {file.name}'):
        _make(file, draw, result)


def _write_page(folder: RunFolder, parts: list[Recording], screen: Screen) -> None:
    from engine_mount.reports import report  # after the drive, as above

    with screen.bar('reading', transient=True) as show:
        made = report.make_report(report.subjects_of(parts), show)
        for failure in made.failures:
            screen.note(failure)
        made.write_page(folder.report)


def _make(file: Path, make: Callable[[], None], result: DriveResult) -> None:
    """Make the picture or page of a drive; what prevents it is a complaint, for the recording is there."""
    try:
        make()
    except Exception as error:  # of any kind: the recording is there
        result.complaints.append(f'{file.name} could not be made: {str(error) or type(error).__name__}')
