"""What the system says of processes: their processor time and memory, from `/proc`."""

import os
from collections.abc import Sequence
from pathlib import Path

_TICK = 1.0 / os.sysconf('SC_CLK_TCK')  # s
_PAGE = os.sysconf('SC_PAGE_SIZE')  # B


def children(words: Sequence[str]) -> list[int]:
    """Return the ids of the processes started by this one that have one of `words` in their command."""
    found = []
    for task in Path('/proc/self/task').iterdir():
        for number in (task / 'children').read_text().split():
            command = Path(f'/proc/{number}/cmdline').read_bytes().decode()
            if any(each in command for each in words):
                found.append(int(number))
    return found


def processor_time(process: int) -> float:
    """Return the processor time (s) of all threads of a process so far."""
    fields = Path(f'/proc/{process}/stat').read_text().rpartition(')')[2].split()
    return _TICK * (int(fields[11]) + int(fields[12]))  # utime and stime, proc(5)


def memory(process: int) -> int:
    """Return the resident memory of a process, B."""
    return _PAGE * int(Path(f'/proc/{process}/statm').read_text().split()[1])
