"""What the fits share: linear algebra on one thread, and how sure fitted numbers are."""

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.optimize import OptimizeResult
from threadpoolctl import threadpool_limits

FloatArray = npt.NDArray[np.float64]
Progress = Callable[[float, str], None]
"""Receives the share that is done (0 .. 1), and what is being done."""


class IdentificationError(ValueError):
    """Recordings do not determine a parameter; the text holds value, limit and remedy."""


def silent(share: float, what: str) -> None:
    """Show no progress."""


single_threaded = threadpool_limits.wrap(limits=1, user_api='blas')
"""Limits BLAS to one thread in a function: on matrices as small as here others only wait for each other."""


def covariance_of(fit: OptimizeResult) -> FloatArray:
    """Return the covariance (P, P) of the unknowns of a least-squares fit, by the scatter of its residuals.

    An unknown that changes nothing has 0.
    """
    jacobian, residuals = np.asarray(fit.jac), np.asarray(fit.fun)
    norms = np.linalg.norm(jacobian, axis=0)
    scale = np.where(norms > 0.0, norms, 1.0)
    freedom = max(1, residuals.size - int(np.count_nonzero(norms)))
    scatter = residuals @ residuals / freedom
    inverse = np.linalg.pinv((jacobian / scale).T @ (jacobian / scale), hermitian=True)
    return scatter * inverse / np.outer(scale, scale)


def rms(values: Any) -> float:
    """Return the rms about 0, NaN of nothing."""
    return float(np.sqrt(np.mean(np.square(values)))) if np.size(values) else float('nan')
