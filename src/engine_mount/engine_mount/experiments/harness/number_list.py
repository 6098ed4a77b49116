"""Lists of numbers as one parameter, written with commas."""

from mount_models.quantity import ParameterError


def numbers_of(name: str, text: str, low: float, high: float) -> list[float]:
    """Return the numbers in `text`; raises `ParameterError` for anything but different ones within limits.

    `name` is what the refusal calls the parameter.
    """
    try:
        values = [float(part) for part in text.split(',') if part.strip()]
    except ValueError:
        values = []
    if not values or not all(low <= value <= high for value in values) or len(set(values)) < len(values):
        raise ParameterError(
            f'{name} ({text!r}) must be different numbers within {low:g} .. {high:g}, separated by commas; '
            'a single one with a comma behind it'
        )
    return values
