"""The figures of a drive: those of `--json`, and the same for people."""

import contextlib
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from engine_mount.recordings.answers import peak_current
from engine_mount.recordings.audit import TopicAudit, control_spans
from engine_mount.recordings.difference import known
from engine_mount.recordings.events import Switching, switching_times
from engine_mount.recordings.losses import Losses
from engine_mount.recordings.recording import Recording
from engine_mount.recordings.screen import Table
from engine_mount.reports.drive.beside import BesideError, mounts_beside, name_of, peaks_text
from engine_mount.reports.drive.evaluation import error_text, tracking_error
from engine_mount.reports.drive.felt import ACCELERATIONS, BANDS, felt_beside, value_text
from engine_mount.reports.drive.signals import DriveSignals, excitation_stamp
from engine_mount.settings.chosen import Parameters, policy_of
from mount_sim.plant.mounts import seat_of, without_friction

if TYPE_CHECKING:
    from mount_bringup.graph.recovery import Restart  # ROS, which a drive in core does without

Figures = dict[str, Any]

_LATE_CONTROL = 0.5  # s, chosen: so much of the excitation may pass before control answers
_MEASURED = ('rest_gap', 'contact_gap', 'rest_gap_std', 'contact_gap_std')


def summarise(
    recording: Recording,
    audits: Mapping[str, TopicAudit],
    found: Losses,
    drive: DriveSignals,
    parameters: Parameters,
    run: Figures,
) -> Figures:
    """Return the figures of a drive from its recording, its audit and its losses; `run` brings the others.

    `run`: `scenario`, `mode`, `excitation_start`, `real_time_factor`, `latency_median_s`, `latency_p99_s`,
    `restarts`, `recordings`. Times are s on the recording's time axis, from which `drive` counts too. Unknown
    or not applicable is null.
    """
    gap, truth = recording['air_gap'], recording['sim/truth']
    start = (excitation_stamp(recording, run['excitation_start']) - drive.zero) / 1e9
    mount = seat_of(parameters)
    begin = switched_on = switched_off = peak = error = None  # with a mount without friction
    if not without_friction(mount):
        trace = recording['control_trace']
        order = np.argsort(trace.stamps, kind='stable')
        time = (trace.stamps[order] - drive.zero) / 1e9
        begin = float(time[0]) if len(time) else None
        on, off = switching_times(time, trace['damping_active'][order])
        switched_on, switched_off = on.tolist(), off.tolist()
        peak = known(peak_current(recording, control_spans(audits)))
        error = known(tracking_error(drive, *policy_of(parameters)))
    peaks = felt = None
    with contextlib.suppress(BesideError):
        beside = mounts_beside(recording, parameters)
        peaks = {name: float(np.max(np.abs(each['displacement']))) for name, each in beside.truths.items()}
        figures = felt_beside(recording, parameters, beside)
        felt = {name: {key: known(value) for key, value in each.items()} for name, each in figures.items()}
    return {
        'recording': str(recording.path),
        'recordings': run['recordings'],
        'scenario': run['scenario'],
        'mode': run['mode'],
        'mount': mount,
        'excitation_start_s': start,
        'control_from_s': begin,
        'duration_s': float(drive.seen.time[-1] - max(drive.seen.time[0], start)),
        **found.as_json(),
        'restarts': [_restart(entry, drive.zero) for entry in run['restarts']],
        'real_time_factor': run['real_time_factor'],
        **{f'{name}_m': float(gap[name][-1]) for name in _MEASURED},
        **{f'true_{name}_m': float(truth[name][-1]) for name in _MEASURED[:2]},
        'offset_current_a': float(gap['offset_current'][-1]),
        'switch_on_s': switched_on,
        'switch_off_s': switched_off,
        'peak_displacement_m': float(np.nanmax(np.abs(drive.seen.displacement))),
        'beside': peaks,
        'felt': felt,
        'peak_current_a': peak,
        'tracking_error_rms': error,
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
