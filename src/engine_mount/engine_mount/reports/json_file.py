"""Figures as a JSON file."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any


def write_json(figures: Mapping[str, Any], file: Path) -> None:
    """Write `figures`; raises `ValueError` for a number that JSON does not know, and `OSError`."""
    file.write_text(json.dumps(figures, indent=2, allow_nan=False) + '\n', encoding='utf-8')
