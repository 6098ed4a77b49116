"""A recorded drive of a real car: friction mount, hydromount and elastomer alone on the same acceleration."""

from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np

from engine_mount.experiments.harness.closed_loop import PAPER, driven, mode_of
from engine_mount.experiments.harness.contract import (
    Experiment,
    ExperimentError,
    Order,
    Outcome,
    Progress,
    Statement,
    parameters_of,
)
from engine_mount.experiments.harness.judgement import holds_if_lower
from engine_mount.experiments.recorded_drive import REFERENCE, TITLE
from engine_mount.experiments.recorded_drive.evaluation import (
    BANDS,
    ELASTOMER,
    FRICTION,
    HYDRO,
    SHORTEST,
    BoolArray,
    near,
    ratios,
    rms_in_bands,
    rms_in_bands_within,
    spectra_of,
)
from engine_mount.reports.drive.evaluation import switching
from engine_mount.reports.drive.signals import DriveSignals, FloatArray, Truth
from engine_mount.signals.excitation import recorded_signal
from mount_control.policy import switched_viscous
from mount_models.damper import damper_curve
from mount_models.quantity import Quantity, with_flattened
from mount_models.sampling import SAMPLE_TIME
from mount_sim.excitation.scenario import AccelerationScale, RecordedScenario

NAME = 'recorded_drive'
_MOUNTS = {FRICTION: 'friction', HYDRO: 'hydro', ELASTOMER: 'elastomer'}


class RecordedDriveParameters(NamedTuple):
    """Where the recorded acceleration stands, as in the scenario `recorded`; and the characteristic."""

    file: str = ''
    column: str = ''
    time_column: str = ''
    topic: str = ''
    scale: AccelerationScale = 1.0
    duration: Annotated[float, Quantity('s', 'so much from its beginning; 0: all of it', 0.0, 3600.0)] = 0.0
    damper: str = switched_viscous.DEFAULT_DAMPER


def run(order: Order, progress: Progress) -> Outcome:
    """Drive every mount on the recording, and evaluate spectra and bands."""
    from engine_mount.experiments.recorded_drive import pictures as drawn
    from engine_mount.experiments.recorded_drive.page import write_recorded_drive

    parameters = parameters_of(order, NAME, RecordedDriveParameters())
    if not parameters.file:
        raise ExperimentError(
            f'{NAME} needs a recorded vertical acceleration (CSV, MCAP, or a folder of NPY pairs): give '
            f'--set {NAME}.file=FILE, its --set {NAME}.column=NAME, and --set {NAME}.scale=-1 where its axis '
            'points down'
        )
    if 0.0 < parameters.duration < SHORTEST:
        raise ExperimentError(
            f'{NAME}.duration ({parameters.duration:g} s) must be at least {SHORTEST:.1f} s for a spectrum, '
            'or 0 for all of the recording'
        )
    damper_curve(parameters.damper)  # refuses an unknown one before anything is made
    rate = recorded_signal(_scenario(parameters)).rate  # refuses what cannot be read
    control = with_flattened(switched_viscous.Parameters(), order.settings.get('mount_control', {}))
    drives = {}
    for number, (name, mount) in enumerate(_MOUNTS.items()):
        progress(0.95 * number / len(_MOUNTS), name)
        drives[name] = driven(order, name.replace(' ', '_'), _own(parameters, mount), NAME)
    progress(0.95, 'pictures')
    spectra = {name: spectra_of(each) for name, each in drives.items()}
    figures = _figures(drives, parameters, control, mode_of(order))
    pictures = [
        drawn.draw_spectra(spectra, order.out / 'recorded_drive_spectra.png'),
        drawn.draw_traces(drives, control, order.out / 'recorded_drive.png'),
    ]
    page = write_recorded_drive(figures, pictures, rate, order.out / f'{NAME}.md')
    recordings = [each.recording for each in drives.values()]
    return Outcome(figures, pictures, recordings, statements(figures), [page])


def _scenario(parameters: RecordedDriveParameters) -> RecordedScenario:
    return RecordedScenario(*(getattr(parameters, name) for name in RecordedScenario._fields))


def _own(parameters: RecordedDriveParameters, mount: str) -> dict[str, dict[str, Any]]:
    return {
        'mount_sim': {
            'scenario': 'recorded',
            'mount': mount,
            'timeline.duration': parameters.duration,
            **{f'recorded.{name}': value for name, value in _scenario(parameters)._asdict().items()},
            'recorded.file': str(Path(parameters.file).absolute()),
        },
        'mount_control': {'policy': PAPER, 'damper': parameters.damper},
    }


def _figures(
    drives: dict[str, DriveSignals],
    parameters: RecordedDriveParameters,
    control: switched_viscous.Parameters,
    mode: str,
) -> dict[str, Any]:
    seen, truth = drives[FRICTION].seen, drives[FRICTION].truth
    active = np.interp(truth.time, seen.time, seen.damping_active.astype(float)) > 0.5
    events = near(active, 1.0 / control.eigenfrequency)
    changes = switching(seen)
    return {
        'source': Path(parameters.file).name,
        'column': parameters.column,
        'scale': parameters.scale,
        'duration_s': float(truth.time[-1] - truth.time[0] + SAMPLE_TIME),
        'acceleration_rms_m_s2': _rms(truth.chassis_acceleration),
        'acceleration_band_rms_m_s2': rms_in_bands(truth.chassis_acceleration),
        'damper': parameters.damper,
        'switch_on_level_m': control.switch_on_level,
        'switch_off_level_m': control.switch_off_level,
        'times_on': len(changes.on),
        'switched_on_s': list(changes.on),
        'switched_off_s': list(changes.off),
        'damping_active_share': float(np.mean(active)),
        'events_share': float(np.mean(events)),
        'events_margin_s': 1.0 / control.eigenfrequency,
        'bands_hz': [list(band) for band in BANDS],
        'mode': mode,
        'runs': {name: _figures_of(each.truth, active, events) for name, each in drives.items()},
    }


def _figures_of(truth: Truth, active: BoolArray, events: BoolArray) -> dict[str, Any]:
    return {
        'displacement_rms_m': _rms(truth.displacement),
        'displacement_peak_m': float(np.max(np.abs(truth.displacement))),
        'displacement_rms_while_friction_is_on_m': _rms(truth.displacement[active]),
        **_bands_of('displacement', 'm', truth.displacement, events),
        'force_rms_n': _rms(truth.mount_force),
        'force_peak_n': float(np.max(np.abs(truth.mount_force))),
        **_bands_of('force', 'n', truth.mount_force, events),
    }


def _bands_of(name: str, unit: str, values: FloatArray, events: BoolArray) -> dict[str, Any]:
    return {
        f'{name}_band_rms_{unit}': rms_in_bands(values),
        f'{name}_band_rms_at_events_{unit}': rms_in_bands_within(values, events),
        f'{name}_band_rms_else_{unit}': rms_in_bands_within(values, ~events),
    }


def _rms(values: FloatArray) -> float | None:
    """Return the rms about 0, None of nothing."""
    return float(np.sqrt(np.mean(values**2))) if len(values) else None


def statements(figures: dict[str, Any]) -> list[Statement]:
    """Return what the paper says about good roads, each with what these figures say to it."""
    return [_on_isolation(figures), _on_displacement(figures)]


def _on_isolation(figures: dict[str, Any]) -> Statement:
    force = ratios(figures, 'force_band_rms_else_n')
    displacement = ratios(figures, 'displacement_band_rms_else_m')
    return Statement(
        'Secs. 1, 7',
        'On good roads the mount is a soft spring without damping and performs better than a classical one.',
        f'Away from the moments of damping, rms over that of the hydromount: force on the chassis '
        f'{_by_band(figures, force)}; displacement {_by_band(figures, displacement)}. Holds if force and '
        'displacement are lower from 5 Hz on; the chassis moves as recorded whatever the force.',
        holds_if_lower([*force[1:], *displacement[1:]]),
    )


def _on_displacement(figures: dict[str, Any]) -> Statement:
    hydro = ratios(figures, 'displacement_band_rms_at_events_m')
    soft = ratios(figures, 'displacement_band_rms_at_events_m', ELASTOMER)
    return Statement(
        'Sec. 7',
        'Lower displacements when damping is on.',
        f'Damping was on {figures["times_on"]} times, {100 * figures["damping_active_share"]:.1f} % of the '
        f'drive. At these moments, rms over that of the hydromount: {_by_band(figures, hydro)}; over that of '
        f'the elastomer alone: {_by_band(figures, soft)}. Holds if lower than the hydromount, 5 to 12 Hz.',
        holds_if_lower(hydro[1:2]),
    )


def _by_band(figures: dict[str, Any], values: list[float]) -> str:
    if not values:
        return 'unknown, for damping was never on'
    return ', '.join(
        f'{value:.2f} ({low:g} to {high:g} Hz)'
        for (low, high), value in zip(figures['bands_hz'], values, strict=True)
    )


EXPERIMENT = Experiment(
    name=NAME,
    title=TITLE,
    reference=REFERENCE,
    summary=(
        'The vertical acceleration that a real car recorded moves the chassis side of the mount, with '
        'friction mount, original hydromount and elastomer alone in the seat. Spectra and bands come from '
        'the recordings of these runs.'
    ),
    defaults=RecordedDriveParameters(),
    run=run,
    closed_loop=True,
    needs='file',
)
