"""Figures and specimen where they are wanted, and which of its parts are still of another one."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console

from engine_mount.cli.terminal import note

if TYPE_CHECKING:
    from mount_models.specimen import Specimen


def write_results(
    console: Console, specimen: 'Specimen', figures: dict[str, Any], json_file: Path | None, out: Path | None
) -> None:
    """Write figures and specimen where they are wanted, and say which parts are of other specimens."""
    from engine_mount.identification.specimen import foreign_parts
    from engine_mount.identification.specimen_file import save_specimen
    from engine_mount.reports.json_file import write_json

    if json_file is not None:
        write_json(figures, json_file)
    if out is not None:
        save_specimen(specimen, out)
        console.print(f'specimen   {out}', soft_wrap=True)
    note_foreign(console, foreign_parts(specimen), specimen.name)


def note_foreign(console: Console, parts: list[str], name: str) -> None:
    """Print which `parts` of the specimen `name` are those of its base, and what makes them its own."""
    command = {
        'force_law': 'calibrate actuator',
        'gap_curves': 'calibrate inductance',
        'friction': 'identify friction',
    }
    for part in parts:
        note(
            console,
            f'{part} is not yet that of {name!r} but of its base; run engine-mount {command[part]} with this '
            'file as --base',
        )
