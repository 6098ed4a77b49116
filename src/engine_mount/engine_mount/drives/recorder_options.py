"""What `--split` and `--snapshot` say, as parameters of the recorder."""

from collections.abc import Mapping, Sequence
from typing import Any

from engine_mount.settings.amounts import duration_in_nanoseconds, split_rule
from mount_models.quantity import ParameterError, with_flattened
from mount_recorder.automatic_marks import mark_kinds
from mount_recorder.diagnosis import OnFull
from mount_recorder.parameters import RecorderParameters, split_of


def recorder_options(split: Sequence[str], snapshot: str, snapshot_after: str = '') -> dict[str, Any]:
    """Return {parameter: value} of texts such as `500MB`, `60s`; raises `ParameterError`."""
    options: dict[str, Any] = {}
    if split:
        rule = split_rule(split)
        options.update(split_size=rule.size, split_duration=rule.duration * 1e-9)
    if snapshot:
        options['snapshot'] = duration_in_nanoseconds(snapshot) * 1e-9
    if snapshot_after:
        options['snapshot_after'] = duration_in_nanoseconds(snapshot_after) * 1e-9
    return options


def checked_recorder(defaults: RecorderParameters, options: Mapping[str, Any]) -> RecorderParameters:
    """Return the recorder's parameters, or raise the `ValueError` with which it would refuse them."""
    parameters = with_flattened(defaults, options)
    split_of(parameters)
    mark_kinds(parameters.automatic_marks)
    if parameters.on_full not in [word.value for word in OnFull]:
        raise ParameterError(f'on_full must be stop or continue; instead received {parameters.on_full!r}')
    return parameters
