"""What of others a drive is given, brought into the plain form that the simulator reads."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from engine_mount.recordings.place import recording_hash
from mount_bringup.graph.nodes import SIM

FOLDER = 'given'
"""In the folder of a run: the files that its simulator reads."""

Settings = dict[str, dict[str, Any]]


@dataclass(frozen=True)
class Brought:
    """A signal of others: the parameter of mount_sim that names its file, how it is written, its provenance.

    `write` writes the file into a folder and returns its path; `told` is plain data for the session, `notes`
    are sentences.
    """

    parameter: str
    write: Callable[[Path], Path]
    told: Mapping[str, Any]
    notes: Sequence[str] = ()


def written(
    brought: Sequence[Brought], parameters: Mapping[str, Mapping[str, Any]], folder: Path
) -> Settings:
    """Write what was brought into `folder` and return the parameters with the paths of the files."""
    settings = {node: dict(values) for node, values in parameters.items()}
    for each in brought:
        settings.setdefault(SIM.name, {})[each.parameter] = str(each.write(folder).absolute())
    return settings


def provenance(brought: Sequence[Brought], parameters: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """Return what the session tells: {'given': {parameter: provenance}}, {} where nothing was brought.

    `parameters` are those with the paths of the written files. As paths last no longer than the folder stays
    where it is, name and hash of what the simulator read are told besides.
    """
    given = {}
    for each in brought:
        file = Path(parameters[SIM.name][each.parameter])
        read = {'file': f'{FOLDER}/{file.name}', 'sha256': recording_hash(file)}
        given[each.parameter] = {**each.told, 'read': read}
    return {'given': given} if given else {}
