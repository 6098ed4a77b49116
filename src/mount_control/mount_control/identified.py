"""What a specimen file says about the friction, put into the controller's parameters."""

from typing import NamedTuple, TypeVar

from mount_control.parameters import ControlParameters
from mount_models.quantity import with_values
from mount_models.specimen import Specimen, SpecimenError

P = TypeVar('P', bound=NamedTuple)


def identified(specimen: Specimen, parameters: P) -> P:
    """Return `parameters` with the values of the specimen wherever they still have their defaults.

    A parameter that was set to something else stays as it was set.
    """
    defaults = type(parameters)._field_defaults
    values = parameters._asdict()
    return with_values(
        parameters,
        **{
            name: value
            for name, value in specimen.friction.items()
            if name in values and values[name] == defaults[name]
        },
    )


def check_fits(settings: ControlParameters, specimen: Specimen) -> None:
    """Raise `SpecimenError` if the controller may ask for more current than was calibrated."""
    if settings.highest_current > specimen.current_limit:
        raise SpecimenError(
            f'highest_current ({settings.highest_current:.3f} A) must not exceed current_limit '
            f'({specimen.current_limit:.3f} A) of the specimen {specimen.name!r}; lower highest_current'
        )
