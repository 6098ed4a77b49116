"""Memory of the system, for tests that count it: `tracemalloc` sees no mapping."""

from types import SimpleNamespace

SEEN = SimpleNamespace(MAP_PRIVATE=0, mmap=lambda _, size, flags: bytearray(size))
"""In place of the module `mmap`."""
