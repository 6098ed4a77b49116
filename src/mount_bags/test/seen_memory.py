"""Memory of the system, for tests that count it: `tracemalloc` sees no mapping."""

from types import SimpleNamespace

SEEN = SimpleNamespace(mmap=lambda _, size: bytearray(size))
"""In place of the module `mmap`."""
