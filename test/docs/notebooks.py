"""Runs the notebooks of docs/tutorials; `python test/docs/notebooks.py` renews what their cells show."""

import os
import tempfile
from collections.abc import Iterator
from pathlib import Path

import nbformat
from nbclient import NotebookClient
from nbformat import NotebookNode

FOLDER = Path(__file__).resolve().parents[2] / 'docs' / 'tutorials'
NOTEBOOKS = sorted(FOLDER.glob('*.ipynb'))
_LIMIT = 240  # s for one cell: only a hang takes so long


def read(file: Path) -> NotebookNode:
    """Return a notebook as it is stored."""
    return nbformat.read(file, as_version=4)


def executed(file: Path) -> NotebookNode:
    """Return the notebook with what its cells print and draw now; raises where one of them fails."""
    notebook = read(file)
    with tempfile.TemporaryDirectory() as own:  # no settings of this user, and none left behind
        places = dict.fromkeys(('IPYTHONDIR', 'JUPYTER_CONFIG_DIR', 'JUPYTER_RUNTIME_DIR'), own)
        environment = {**os.environ, **places}
        client = NotebookClient(
            notebook, timeout=_LIMIT, kernel_name='python3', record_timing=False, coalesce_streams=True,
            resources={'metadata': {'path': str(FOLDER)}},
        )  # fmt: skip
        manager = client.create_kernel_manager()
        manager.transport, manager.ip = 'ipc', f'{own}/kernel'  # files in place of ports
        client.execute(env=environment)
    notebook.metadata.language_info = {'name': 'python'}  # without the version of this machine
    return notebook


def printed(notebook: NotebookNode) -> list[str]:
    """Return what each cell prints, pictures left out."""
    return [''.join(texts(cell)) for cell in notebook.cells if cell.cell_type == 'code']


def texts(cell: NotebookNode) -> Iterator[str]:
    """Yield the texts below a cell."""
    for output in cell.outputs:
        if output.output_type == 'stream':
            yield output.text
        elif 'image/png' not in output.data:
            yield output.data['text/plain']


def pictures(notebook: NotebookNode) -> int:
    """Return how many pictures stand in a notebook."""
    outputs = [output for cell in notebook.cells if cell.cell_type == 'code' for output in cell.outputs]
    return sum('image/png' in output.get('data', {}) for output in outputs)


if __name__ == '__main__':
    for place in NOTEBOOKS:
        nbformat.write(executed(place), place)
