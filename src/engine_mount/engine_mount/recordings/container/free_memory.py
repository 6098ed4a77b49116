"""Freed memory, given back to the system: the C library keeps what lies between things still in use."""

import ctypes


def give_back() -> None:
    """Give back what is free; where the C library is not that of GNU, nothing happens."""
    trim = getattr(ctypes.CDLL(None), 'malloc_trim', None)
    if trim is not None:
        trim(0)
