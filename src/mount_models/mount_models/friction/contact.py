"""Linear part of the friction contact: what gives way before and while the pads slide (Fig. 6)."""

from typing import Annotated, NamedTuple

from mount_models.quantity import Quantity


class FrictionContact(NamedTuple):
    """Spring c_Re in series with c_R parallel to d_R; the deflection of the parallel pair is xi.

    The paper prints no values. These are chosen: sticking gives way within 0.1 mm, xi creeps with
    d_R / c_R = 0.5 s, as its text suggests (good fit for times above 1 s).
    """

    tangential_stiffness: Annotated[
        float, Quantity('N/m', 'c_R: spring of the creeping element', 1e4, 1e9)
    ] = 1.0e7
    tangential_damping: Annotated[
        float, Quantity('N s/m', 'd_R: damper of the creeping element', 1e2, 1e9)
    ] = 5.0e6
    contact_stiffness: Annotated[
        float, Quantity('N/m', 'c_Re: spring between the mount and the creeping element', 1e4, 1e9)
    ] = 4.0e6
