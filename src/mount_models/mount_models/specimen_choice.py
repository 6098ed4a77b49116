"""Which specimen a node works with; apart from `specimen.py`, which takes a second to load."""

from typing import Annotated, NamedTuple

from mount_models.quantity import Quantity


class SpecimenChoice(NamedTuple):
    """The file of a specimen, and the name that it must have."""

    parameters_file: Annotated[
        str, Quantity('path', 'specimen file of the mount; empty: the specimen that is shipped')
    ] = ''
    specimen: Annotated[str, Quantity('name', 'name that the specimen in the file must have; empty: any')] = (
        ''
    )
