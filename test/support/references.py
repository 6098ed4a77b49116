"""The reference recordings of this project."""

from pathlib import Path

REFERENCES_FOLDER = Path(__file__).parents[2] / 'bags' / 'reference'
REFERENCES = sorted(path for path in REFERENCES_FOLDER.iterdir() if path.is_dir())
