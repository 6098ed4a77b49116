"""The calibration of an actuator: its force law with figures, tables and the specimen made of it."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from engine_mount.identification.actuator.fit import ForceLawFit
from engine_mount.identification.specimen import described_files, rounded, with_part
from engine_mount.recordings.screen import Screen, Table
from mount_models.specimen import Specimen


@dataclass(frozen=True)
class ActuatorCalibration:
    """A fitted force law, the files it comes from, and the specimen that gives all other values."""

    fit: ForceLawFit
    base: Specimen
    files: Sequence[Path]

    def figures(self) -> dict[str, Any]:
        """Return parameters and errors for JSON, SI units; None where one is not known."""
        fit, law = self.fit, self.fit.law
        stds = iter(np.sqrt(fit.covariance.diagonal().clip(0.0)).tolist())
        parts = {f'a{number}': list(part) for number, part in enumerate(law[:5], 1)}
        relative_rms, worst = self._relative()
        return {
            'parameters': parts,
            'parameter_std': {name: [next(stds) for _ in part] for name, part in parts.items()},
            'valid_gap_m': [law.gap_low, law.gap_high],
            'valid_current_a': [0.0, law.current_high],
            'measured_current_a': [fit.lowest_current, law.current_high],
            'points': fit.error.size,
            'relative_rms': None if np.isnan(worst) else relative_rms,
            'relative_worst': None if np.isnan(worst) else worst,
            'rms_error_n': float(np.sqrt(np.mean(fit.error**2))),
            'largest_error_n': float(np.abs(fit.error).max()),
            'rms_by_gap': [
                {'gap_m': float(gap), 'rms_n': float(rms)}
                for gap, rms in zip(fit.gaps, fit.gap_rms, strict=True)
            ],
        }

    def report(self, screen: Screen) -> None:
        """Show the errors of each gap, and where the law may be used."""
        fit, law, found = self.fit, self.fit.law, self.figures()
        rows = [(f'{1e6 * gap:.1f}', f'{rms:.2f}') for gap, rms in zip(fit.gaps, fit.gap_rms, strict=True)]
        count = sum(map(len, law[:5]))
        title = f'force law, {count} parameters'
        screen.table(Table(title, 'rr', rows, ('air gap (um)', 'rms error (N)')))
        relative_rms, worst = self._relative()
        screen.say(
            f'{found["points"]} points; error rms {relative_rms:.2%} of the force above 20 N, worst '
            f'{worst:.2%}; rms {found["rms_error_n"]:.2f} N, largest {found["largest_error_n"]:.2f} N'
        )
        screen.say(
            f'positive, rising with the current and falling with the gap within {law.gap_low * 1e6:.1f} .. '
            f'{law.gap_high * 1e6:.1f} um and 0 .. {law.current_high:.2f} A; refused beyond'
        )
        if fit.continued:
            screen.say(
                f'measured from {fit.lowest_current:.2f} A on; below, the law is continued to 0 N at 0 A'
            )

    def specimen(self, name: str = '') -> Specimen:
        """Return the base under `name` with the fitted law; raises `SpecimenError`."""
        fit, law, found = self.fit, self.fit.law, self.figures()
        valid: dict[str, Any] = {'gap': found['valid_gap_m'], 'current': found['valid_current_a']}
        if fit.continued:
            valid['measured_current'] = [rounded(fit.lowest_current), law.current_high]
        origin = {
            'points': found['points'],
            'valid': valid,
            'residuals': {
                **{name: rounded(value) for name, value in zip(
                    ('relative_rms', 'relative_worst', 'rms', 'largest'),
                    (*self._relative(), found['rms_error_n'], found['largest_error_n']), strict=True)},
                'gaps': [float(f'{gap:.6g}') for gap in fit.gaps],
                'rms_by_gap': rounded(fit.gap_rms),
            },
            'covariance': rounded(fit.covariance),
        }  # fmt: skip
        limit = min(self.base.current_limit, law.current_high)
        recordings = described_files(self.files)
        return with_part(self.base, name, 'force_law', recordings, origin, force_law=law, current_limit=limit)

    def draw(self, file: Path) -> None:
        """Write the picture of points and law to `file` (PNG)."""
        from engine_mount.identification.pictures import draw_force_law

        draw_force_law(self.fit, file)

    def _relative(self) -> tuple[float, float]:
        """Return rms and largest of the errors over the forces above 20 N; NaN where there are none."""
        relative = self.fit.relative
        return float(np.sqrt(np.mean(relative**2))), float(np.abs(relative).max())
