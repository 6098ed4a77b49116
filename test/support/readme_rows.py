"""The rows of a README's table of parameters."""

from collections.abc import Iterator

from mount_models.quantity import quantities


def readme_rows(parameters, prefix: str = '') -> Iterator[str]:
    """Yield a row for each number of a parameter set, with default, unit, range and meaning."""
    for name, note in quantities(parameters).items():
        default = getattr(parameters, name)
        if isinstance(default, int | float) and not isinstance(default, bool):
            yield (
                f'| `{prefix}{name}` | {default:g} | {note.unit} '
                f'| {note.low:g} .. {note.high:g} | {note.meaning} |'
            )
