"""What a drive says at its end: the figures of `--json`, and the same for people."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from engine_mount.recordings.answers import peak_current
from engine_mount.recordings.audit import TopicAudit, control_spans
from engine_mount.recordings.events import switching_times
from engine_mount.recordings.losses import Losses
from engine_mount.recordings.recording import Recording
from engine_mount.recordings.screen import Screen, Table
from engine_mount.reports.drive.evaluation import tracking_error
from engine_mount.reports.drive.signals import DriveSignals, excitation_stamp
from engine_mount.settings.chosen import Parameters, policy_of
from mount_bringup.graph.recovery import Restart
from mount_recorder.parameters import RecorderParameters
from mount_sim.mount_choice import seat_of
from mount_sim.plant.mounts import without_friction

_UM, _MM, _US = 1e6, 1e3, 1e6
_LATE_CONTROL = 0.5  # s, chosen: so much of the excitation may pass before control answers


def summarise(
    recording: Recording,
    audits: Mapping[str, TopicAudit],
    found: Losses,
    drive: DriveSignals,
    parameters: Parameters,
    run: dict[str, Any],
) -> dict[str, Any]:
    """Return the figures of a drive from its recording, its audit and its losses; `run` brings the others.

    `run`: `scenario`, `mode`, `excitation_start`, `real_time_factor`, `latency_median_s`, `latency_p99_s`,
    `restarts`, `recordings`. Times are s on the recording's time axis, from which `drive` counts too. Unknown
    or not applicable is null.
    """
    gap = recording['air_gap']
    truth = recording['sim/truth']
    start = (excitation_stamp(recording, run['excitation_start']) - drive.zero) / 1e9
    friction = _friction_figures(recording, audits, drive, parameters)
    return {
        'recording': str(recording.path),
        'recordings': run['recordings'],
        'scenario': run['scenario'],
        'mode': run['mode'],
        'mount': seat_of(parameters),
        'excitation_start_s': start,
        'control_from_s': friction.control_from,
        'duration_s': float(drive.seen.time[-1] - max(drive.seen.time[0], start)),
        **found.as_json(),
        'restarts': [_restart(entry, drive.zero) for entry in run['restarts']],
        'real_time_factor': run['real_time_factor'],
        'rest_gap_m': float(gap['rest_gap'][-1]),
        'contact_gap_m': float(gap['contact_gap'][-1]),
        'rest_gap_std_m': float(gap['rest_gap_std'][-1]),
        'contact_gap_std_m': float(gap['contact_gap_std'][-1]),
        'true_rest_gap_m': float(truth['rest_gap'][-1]),
        'true_contact_gap_m': float(truth['contact_gap'][-1]),
        'offset_current_a': float(gap['offset_current'][-1]),
        'switch_on_s': friction.switch_on,
        'switch_off_s': friction.switch_off,
        'peak_displacement_m': float(np.nanmax(np.abs(drive.seen.displacement))),
        'peak_current_a': friction.peak_current,
        'tracking_error_rms': friction.tracking_error,
        'latency_median_s': _known(run['latency_median_s']),
        'latency_p99_s': _known(run['latency_p99_s']),
    }


@dataclass(frozen=True)
class _FrictionFigures:
    """What the control did to the friction; all None with a mount in which it can do nothing."""

    control_from: float | None = None
    switch_on: list[float] | None = None
    switch_off: list[float] | None = None
    peak_current: float | None = None
    tracking_error: float | None = None


def _friction_figures(
    recording: Recording, audits: Mapping[str, TopicAudit], drive: DriveSignals, parameters: Parameters
) -> _FrictionFigures:
    if without_friction(seat_of(parameters)):
        return _FrictionFigures()
    trace = recording['control_trace']
    order = np.argsort(trace.stamps, kind='stable')
    time = (trace.stamps[order] - drive.zero) / 1e9
    on, off = switching_times(time, trace['damping_active'][order])
    error = tracking_error(drive, *policy_of(parameters))
    return _FrictionFigures(
        control_from=float(time[0]) if len(time) else None,
        switch_on=on.tolist(),
        switch_off=off.tolist(),
        peak_current=_known(peak_current(recording, control_spans(audits))),
        tracking_error=_known(error),
    )


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


def _restart(restart: Restart, zero: int) -> dict[str, Any]:
    return {
        'time_s': (restart.time - zero) / 1e9,
        'nodes': [node.name for node in restart.nodes],
        'reason': restart.reason,
        'remedy': restart.action.value,
        'took_s': restart.took,
    }


def summarise_snapshots(snapshots: list[Path], run: dict[str, Any]) -> dict[str, Any]:
    """Return the figures of a drive that recorded only events: those of `run`, as in `summarise`."""
    return {
        'snapshots': [str(place) for place in snapshots],
        'scenario': run['scenario'],
        'mode': run['mode'],
        'samples': run['samples'],
        'real_time_factor': run['real_time_factor'],
        'latency_median_s': _known(run['latency_median_s']),
        'latency_p99_s': _known(run['latency_p99_s']),
    }


def snapshots_sentence(count: int, parameters: RecorderParameters) -> str:
    """Return what a drive with `--snapshot` saved."""
    if not count:
        return 'No event came, so no snapshot was saved; m or space sets one by hand in real time.'
    noun = 'snapshot was' if count == 1 else 'snapshots were'
    return (
        f'{count} {noun} saved, up to {parameters.snapshot:g} s before an event and '
        f'{parameters.snapshot_after:g} s after it; figures of the drive need a full recording.'
    )


def print_summary(figures: dict[str, Any], found: Losses, screen: Screen, mount: str = '') -> None:
    """Print the figures, `mount` before their title; times are s from the first displacement sample."""
    rows = [
        *(_gap_row(figures, name) for name in ('rest', 'contact')),
        ('excitation', f'from {figures["excitation_start_s"]:.2f} s on'),
        *_control_row(figures),
        ('peak displacement', f'{_MM * figures["peak_displacement_m"]:.2f} mm'),
        *_friction_rows(figures),
        *found.rows(),
        *_restart_rows(figures),
        ('latency', _latency_text(figures)),
        ('speed', f'{figures["real_time_factor"]:.2f} x real time'),
    ]
    screen.table(Table(f'{mount}{figures["scenario"]}, {figures["mode"]}', 'll', rows))


def _gap_row(figures: dict[str, Any], name: str) -> tuple[str, str]:
    measured, std = _UM * figures[f'{name}_gap_m'], _UM * figures[f'{name}_gap_std_m']
    true = _UM * figures[f'true_{name}_gap_m']
    return f'{name} gap', f'{measured:.1f} ± {std:.1f} µm measured, {true:.1f} µm true'


def _control_row(figures: dict[str, Any]) -> list[tuple[str, str]]:
    if without_friction(figures['mount']):
        return []
    begin = figures['control_from_s']
    return [('control', 'answered no sample' if begin is None else f'from {begin:.2f} s on')]


def _switching_text(figures: dict[str, Any]) -> str:
    ons, offs = figures['switch_on_s'], figures['switch_off_s']
    if not ons:
        return 'never on'
    pairs = [(on, next((off for off in offs if off > on), None)) for on in ons]
    shown = [f'{on:.2f} s to {f"{off:.2f} s" if off is not None else "the end"}' for on, off in pairs]
    more = f' and {len(shown) - 6} more' if len(shown) > 6 else ''
    return 'on from ' + ', '.join(shown[:6]) + more


def _friction_rows(figures: dict[str, Any]) -> list[tuple[str, str]]:
    if reason := without_friction(figures['mount']):
        return [('friction', f'not applicable: {reason}')]
    peak = figures['peak_current_a']
    return [
        ('damping switched', _switching_text(figures)),
        ('peak current', 'unknown' if peak is None else f'{peak:.2f} A'),
        ('friction force error', _percent(figures['tracking_error_rms'], 'rms of the peak wanted force')),
    ]


def _latency_text(figures: dict[str, Any]) -> str:
    median, p99 = figures['latency_median_s'], figures['latency_p99_s']
    if median is None or p99 is None:
        return 'none (no middleware)'
    return f'{_US * median:.0f} µs median, {_US * p99:.0f} µs in 99 of 100 (sample sent to setpoint back)'


def _restart_rows(figures: dict[str, Any]) -> list[tuple[str, str]]:
    return [
        (
            f'lost at {entry["time_s"]:.1f} s',
            f'{entry["reason"]}; {entry["remedy"]} ({entry["took_s"]:.1f} s)',
        )
        for entry in figures['restarts']
    ]


def _percent(value: float | None, of_what: str) -> str:
    return 'damping was never on' if value is None else f'{100 * value:.1f} % {of_what}'


def _known(value: float) -> float | None:
    return None if value is None or math.isnan(value) else float(value)
