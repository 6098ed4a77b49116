"""The paper's model as a rung: the full model, Eqs (7), (8), with the coefficient of Eqs (12)-(14)."""

from collections.abc import Sequence

import numpy as np

from engine_mount.identification.friction.laws.law import LawParameter, levels, typical_force
from engine_mount.identification.friction.recording import FloatArray, FrictionRecording
from engine_mount.identification.friction.steps.coefficient_fit import NORMALISED_AT
from mount_models.arithmetic.compiled import compiled
from mount_models.friction.coefficient import FrictionCoefficients
from mount_models.friction.contact import FrictionContact
from mount_models.quantity import Quantity
from mount_sim.plant.friction import full_step

_LOAD_SPREAD = 0.05
"""Loads that differ by less (of their mean) do not tell how mu depends on them."""


class PadModel:
    """The paper's model, on products that are identifiable (see `coefficient_fit`).

    Loads and speeds are related to those of the training: alpha and beta are 1 at `reference` (N), do not
    change beyond `lowest` and `highest`, and stay 1 where only one load was trained. `known` starts the
    search at what steps 1 to 3 have found.
    """

    name = "paper's model"

    def __init__(
        self,
        recordings: Sequence[FrictionRecording],
        known: tuple[FrictionContact, FrictionCoefficients] | None = None,
    ):
        """Take the training's recordings for the range of loads and speeds."""
        loads = [float(each.normal_force.mean()) for each in recordings]
        self.reference = float(np.mean(loads))
        self.lowest, self.highest = min(loads), max(loads)
        self.with_load = self.highest - self.lowest > _LOAD_SPREAD * self.reference
        steps = [np.abs(np.diff(each.displacement)) / each.dt for each in recordings]
        self.top_speed = max(float(np.percentile(each, 99)) for each in steps)
        self.known = known
        rise = 0.95 if self.with_load else 1e-9
        self.parameters: tuple[LawParameter, ...] = (
            LawParameter('A_p1', Quantity('1', 'offset of a, to the positive side', -5.0, 1e6), False),
            LawParameter('A_p2', Quantity('1', 'logarithmic gain of a, positive', 1e-4, 1e5)),
            LawParameter('A_p3', Quantity('1', 'shift in the logarithm, positive', 1e-3, 10.0)),
            LawParameter('A_n1', Quantity('1', 'offset of a, to the negative side', -5.0, 1e6), False),
            LawParameter('A_n2', Quantity('1', 'logarithmic gain of a, negative', 1e-4, 1e5)),
            LawParameter('A_n3', Quantity('1', 'shift in the logarithm, negative', 1e-3, 10.0)),
            LawParameter('s_p', Quantity('1', 'rise of a with F_N / F_ref, positive', 0.0, rise), False),
            LawParameter('s_n', Quantity('1', 'rise of a with F_N / F_ref, negative', 0.0, rise), False),
            LawParameter(
                'b_offset', Quantity('1/mm', 'part of b that depends on nothing', -30.0, 30.0), False
            ),
            LawParameter('B_1', Quantity('1/mm', 'b at rest', -100.0, 100.0), False),
            LawParameter('B_2', Quantity('s/mm^2', 'change of b with speed', -10.0, 10.0), False),
            LawParameter('s_b', Quantity('1', 'rise of b with F_N / F_ref', -2.0 * rise, 2.0 * rise), False),
            LawParameter('c_R', Quantity('N/m', 'spring of the creeping element', 1e2, 1e10)),
            LawParameter('d_R', Quantity('N s/m', 'damper of the creeping element', 1e1, 1e10)),
            LawParameter('c_Re', Quantity('N/m', 'spring in series', 1e2, 1e10)),
        )

    def start(self, recordings: Sequence[FrictionRecording]) -> FloatArray:
        """Return the result of steps 1 to 3 where there is one, else levels and stiffnesses of their size."""
        if self.known is not None:
            return self._from_known(*self.known)
        level_p, level_n = levels(recordings)
        stiffness = (
            20.0 * typical_force(recordings) / max(float(np.ptp(each.displacement)) for each in recordings)
        )
        rise = 0.3 if self.with_load else 0.0
        gain = 0.1
        logarithm = gain * np.log(0.3 + 0.5e3 * self.top_speed)
        return np.array(
            [
                level_p * (1.0 - logarithm), level_p * gain, 0.3,
                level_n * (1.0 - logarithm), level_n * gain, 0.3,
                rise, rise, 0.0, -0.01, 0.0, 0.0, 5.0 * stiffness, 2.5 * stiffness, stiffness,
            ]
        )  # fmt: skip

    def simulate(
        self, values: FloatArray, displacement: FloatArray, dt: float, normal_force: FloatArray
    ) -> FloatArray:
        """Return the force (N); see `FrictionLaw`."""
        contact, coefs = self.model(values)
        return pad_force(contact, coefs, displacement, dt, normal_force)

    def model(self, values: FloatArray) -> tuple[FrictionContact, FrictionCoefficients]:
        """Return the parameters as full and simplified model take them."""
        (
            a_p1, a_p2, a_p3, a_n1, a_n2, a_n3, s_p, s_n, b_offset, b_1, b_2, s_b, c_r, d_r, c_re,
        ) = (float(value) for value in values)  # fmt: skip
        if not self.with_load:
            s_p = s_n = s_b = 0.0
        reference = self.reference
        coefs = FrictionCoefficients(
            b_offset=b_offset, b_1=b_1, b_2=b_2, beta_1=1.0 - s_b, beta_2=s_b / reference,
            a_p1=a_p1, a_p2=a_p2, a_p3=a_p3, a_n1=a_n1, a_n2=a_n2, a_n3=a_n3,
            alpha_p1=1.0 - s_p, alpha_p2=s_p / reference, alpha_n1=1.0 - s_n, alpha_n2=s_n / reference,
            slope_velocity_limit=min(self.top_speed, 0.01),
            lowest_normal_force=self.lowest, highest_normal_force=self.highest,
        )  # fmt: skip
        return FrictionContact(c_r, d_r, c_re), coefs

    def _from_known(self, contact: FrictionContact, coefs: FrictionCoefficients) -> FloatArray:
        shift = (self.reference - NORMALISED_AT) if self.with_load else 0.0

        def factors(first: float, second: float) -> tuple[float, float]:
            at_reference = first + second * (NORMALISED_AT + shift)
            return at_reference, second * self.reference / at_reference if self.with_load else 0.0

        up, s_p = factors(coefs.alpha_p1, coefs.alpha_p2)
        down, s_n = factors(coefs.alpha_n1, coefs.alpha_n2)
        slope, s_b = factors(coefs.beta_1, coefs.beta_2)
        return np.array(
            [
                up * coefs.a_p1, up * coefs.a_p2, coefs.a_p3, down * coefs.a_n1, down * coefs.a_n2,
                coefs.a_n3,
                s_p, s_n, coefs.b_offset, slope * coefs.b_1, slope * coefs.b_2, s_b, *contact,
            ]
        )  # fmt: skip


@compiled
def pad_force(contact, coefs, displacement, dt, normal_force):
    """Return the force of the full model; each direction of sliding has its own normal force."""
    force = np.zeros(displacement.size)
    slider = displacement[0]
    xi = 0.0
    for k in range(1, displacement.size):
        new, new_slider, new_xi, _ = full_step(
            contact, coefs, slider, xi, displacement[k], normal_force[k, 0], dt
        )
        if new < 0.0 and normal_force[k, 1] != normal_force[k, 0]:
            new, new_slider, new_xi, _ = full_step(
                contact, coefs, slider, xi, displacement[k], normal_force[k, 1], dt
            )
        force[k], slider, xi = new, new_slider, new_xi
    return force
