"""What Linux tells of processes: who started them, whether they still run, which shared memory they hold."""

from pathlib import Path
from typing import NamedTuple

SHARED_MEMORY = Path('/dev/shm')
_STATE, _PARENT, _BEGIN = 0, 1, 19  # fields of /proc/<pid>/stat behind the name, proc(5)


class Process(NamedTuple):
    """A process, which no later one of the same number can be taken for."""

    pid: int
    begin: int  # clock ticks since the machine began

    @property
    def alive(self) -> bool:
        """Whether it still runs; a zombie does not."""
        fields = _fields(self.pid)
        return bool(fields) and int(fields[_BEGIN]) == self.begin and fields[_STATE] != 'Z'

    @property
    def command(self) -> str:
        """Its command line; empty when it has ended."""
        return _read(self.pid, 'cmdline').replace('\0', ' ')

    def shared_memory(self) -> set[str]:
        """Return the names of the files of shared memory that it has mapped or open."""
        lines = _read(self.pid, 'maps').splitlines()
        places = {line.split(maxsplit=5)[-1] for line in lines if f' {SHARED_MEMORY}/' in line}
        return {Path(place.removesuffix(' (deleted)')).name for place in places}


def descendants(pid: int) -> list[Process]:
    """Return the processes that `pid` has started, and those that these have."""
    table = {int(path.name): _fields(int(path.name)) for path in Path('/proc').glob('[0-9]*')}
    found: list[Process] = []
    parents = {pid}
    while parents:
        children = {
            each: fields for each, fields in table.items() if fields and int(fields[_PARENT]) in parents
        }
        found += [Process(each, int(fields[_BEGIN])) for each, fields in children.items()]
        parents = set(children)
    return found


def process_of(pid: int) -> Process:
    """Return the process that has the number now."""
    fields = _fields(pid)
    return Process(pid, int(fields[_BEGIN]) if fields else 0)


def shared_memory_of_others(pid: int) -> set[str]:
    """Return the names of the files of shared memory that any process but `pid` has mapped."""
    others = (Process(int(path.name), 0) for path in Path('/proc').glob('[0-9]*') if int(path.name) != pid)
    return set().union(*(each.shared_memory() for each in others))


def _fields(pid: int) -> list[str]:
    """Return the fields of `stat` behind the name, which may hold anything; none when it has ended."""
    return _read(pid, 'stat').rpartition(') ')[2].split()


def _read(pid: int, file: str) -> str:
    try:
        return Path(f'/proc/{pid}/{file}').read_text(errors='replace')
    except (FileNotFoundError, ProcessLookupError, PermissionError):
        return ''
