"""Calibrate an actuator from recordings of a rack: `actuator`, `inductance`, and a simulated `rack`.

Each of the first two returns a result with `figures()` in SI units, `report(screen)` for people, `draw(file)`
and `specimen(name)`.
"""

import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from engine_mount.identification.fitting import Progress, silent
from engine_mount.identification.force_law import ActuatorCalibration, fit_force_law
from engine_mount.identification.inductance import InductanceCalibration, calibrate_inductance
from engine_mount.identification.rack import FileValues, read_force, read_ripple
from engine_mount.signals.mapping import Mapping
from mount_models.coil.correction import CONDUCTIVITY_COEFFICIENT
from mount_models.specimen import chosen_specimen

Place = str | os.PathLike[str]

_FLOOR = 0.006  # chosen: weights as 2 N of 330 N


def actuator(
    files: Sequence[Place],
    *,
    columns: Mapping | dict[str, str] | None = None,
    values: FileValues | None = None,
    base: Place = '',
    progress: Progress = silent,
) -> ActuatorCalibration:
    """Return the force law, Eqs (3) and (4), fitted to measured points of gap, current and force.

    `columns` is {quantity: 'COLUMN:UNIT'} for gap, current and force, `values` holds the gaps of single
    files. `base` is the specimen file that gives all other values, the shipped one without. Raises
    `LawRefusedError` for outliers, too few gaps or currents, and a law that is not positive, rising with the
    current and falling with the gap within the measured range; and the readers' errors.
    """
    paths = [Path(file) for file in files]
    points = read_force(paths, columns or {}, values or FileValues())
    fit = fit_force_law(*points, _FLOOR * float(points.force.max()), progress)
    return ActuatorCalibration(fit, chosen_specimen(str(base)), paths)


def inductance(
    files: Sequence[Place],
    *,
    columns: Mapping | dict[str, str] | None = None,
    values: FileValues | None = None,
    rest_current: float | None = None,
    crossing_inductance: float | None = None,
    turns_area: float | None = None,
    supply: float | None = None,
    coefficient: float | None = None,
    held_out: Sequence[float] = (),
    base: Place = '',
) -> InductanceCalibration:
    """Return the gap curves L_0.2 and i_20 (Fig. 4), fitted to coil ripple recorded at known gaps.

    The temperature with most recordings is that of the curves, recordings at a second one measure the
    compensation; in between it goes by the conductivity's `coefficient` (1/K). `rest_current` (A),
    `crossing_inductance` (H), `turns_area` (m^2) and `supply` (V) are those of the `base` (a specimen file,
    the shipped one without) where they are not given. Recordings at temperatures `held_out` (degC) only
    judge. Raises `LawRefusedError` and the readers' errors.
    """
    starting, paths = chosen_specimen(str(base)), [Path(file) for file in files]
    starting = replace(
        starting,
        rest_current=rest_current or starting.rest_current,
        crossing_inductance=crossing_inductance or starting.crossing_inductance,
        turns_area=turns_area or starting.turns_area,
        bridge=starting.bridge._replace(link_voltage=supply or starting.bridge.link_voltage),
    )
    recordings = read_ripple(paths, columns or {}, values or FileValues(), starting.turns_area)
    if coefficient is None:
        coefficient = CONDUCTIVITY_COEFFICIENT
    return calibrate_inductance(recordings, starting, paths, coefficient, held_out)


def rack(
    folder: Place,
    *,
    seed: int = 0,
    noise: float = 0.01,
    drawn: bool = False,
    celsius: Sequence[float] = (20.0, 80.0),
    progress: Progress = silent,
) -> list[Path]:
    """Write recordings of the simulated rack into `folder`: force, ripple at 16 gaps, friction of the pads.

    With `drawn` they are of another actuator with other pads, drawn by `seed` around the default ones;
    `noise` is the relative standard deviation of each sensor, `celsius` are coil temperatures of the ripple.
    """
    from mount_models.friction.coefficient import FrictionCoefficients
    from mount_models.friction.contact import FrictionContact
    from mount_sim.rack import Rack, drawn_friction, drawn_rack, write_force, write_friction, write_ripple

    simulated = (drawn_rack(seed) if drawn else Rack(seed=seed))._replace(noise=noise)
    pads = drawn_friction(seed) if drawn else (FrictionContact(), FrictionCoefficients())
    out, steps = Path(folder), 2 + len(celsius)
    out.mkdir(parents=True, exist_ok=True)
    written = [write_force(simulated, out / 'force.csv')]
    for number, temperature in enumerate(celsius, 1):
        progress(number / steps, 'measuring')
        written += write_ripple(simulated, out, temperature=temperature)
    progress(1.0 - 1.0 / steps, 'measuring')
    return [*written, *write_friction(out, *pads, noise, seed)]
