"""Linear algebra on one thread: matrices of the fits are so small that others only make each other wait."""

import functools
from collections.abc import Callable
from typing import ParamSpec, TypeVar

from threadpoolctl import threadpool_limits

P = ParamSpec('P')
R = TypeVar('R')


def single_threaded(function: Callable[P, R]) -> Callable[P, R]:
    """Return `function` with BLAS limited to one thread while it runs; afterwards it has its threads back."""

    @functools.wraps(function)
    def limited(*args: P.args, **kwargs: P.kwargs) -> R:
        with threadpool_limits(limits=1, user_api='blas'):
            return function(*args, **kwargs)

    return limited
