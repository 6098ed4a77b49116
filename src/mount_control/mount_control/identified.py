"""What a specimen file says about the friction, put into the controller's parameters."""

from collections.abc import Mapping
from typing import Any, NamedTuple, TypeVar

from mount_control.parameters import ControlParameters
from mount_models.quantity import with_flattened, with_values
from mount_models.specimen import Specimen, SpecimenError

P = TypeVar('P', bound=NamedTuple)


def identified(specimen: Specimen, defaults: P, settings: Mapping[str, Any], prefix: str) -> P:
    """Return the set that holds: what `settings` name as `prefix.name`, else the specimen's, else `defaults`.

    What is set holds even where it equals the default.
    """
    known = {name: value for name, value in specimen.friction.items() if name in defaults._fields}
    return with_flattened(with_values(defaults, **known), settings, prefix)


def check_fits(settings: ControlParameters, specimen: Specimen) -> None:
    """Raise `SpecimenError` if the controller may ask for more current than was calibrated."""
    if settings.highest_current > specimen.current_limit:
        raise SpecimenError(
            f'highest_current ({settings.highest_current:.3f} A) must not exceed current_limit '
            f'({specimen.current_limit:.3f} A) of the specimen {specimen.name!r}; lower highest_current'
        )
