"""The ripple's field in a plate with its air gap by two-dimensional finite elements: checks `plate_field`.

Planar, one plate by itself, a quarter of the circuit: half a plate, half a gap, a quarter of the path.
Unknown is the vector potential A with B = (-dA/dy, dA/dx); x runs from the middle of the plate outwards, y
from the middle of the gap along the plate. First the nonlinear steady field of the mean current, then the
small alternating field about it, with the slope of the magnetisation curve where it stands and eddy currents
in the iron. Imposed is the mean flux density in the middle of the plate, the same triangle as in
`plate_field`, so that both answer the same question; the current follows. With the linkage of the winding
imposed instead, the air beside the plate would take its share, which depends on the winding chosen here.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse import bmat, csc_matrix
from scipy.sparse.linalg import splu
from skfem import Basis, BilinearForm, ElementQuad2, LinearForm, MeshQuad, enforce
from skfem.helpers import dot

from engine_mount.reports.drive.signals import FloatArray
from mount_sim.plant.reluctance import MU_0, ReluctanceActuator, core_flux_density
from mount_sim.plant.ripple import RippleCoil, duty

# beside the plate, m, chosen
_AIR_WIDTH = 10e-3
_WINDING_INSIDE, _WINDING_OUTSIDE = 0.5e-3, 3.5e-3  # from the plate
_WINDING_START = 8e-3  # from the gap
_MOST_STEPS = 60
_SAME_FIELD = 1e-9
_STEPS = 16  # in each part of the period
_GAMMA = 1.0 - 0.5**0.5
_GAUSS = (0.5 - 12.0**-0.5, 0.5 + 12.0**-0.5)
_GROWTH = 1.25  # of the elements, away from a surface


class FieldError(ValueError):
    """The finite-element computation did not come to an end; the text says where and the remedy."""


@dataclass(frozen=True)
class PlateField:
    """The field at one mean current.

    `depth` (m, from the surface) and `change` (T) are of shape (n,): the alternating flux density at the
    middle of the plate's length, as it has changed from switching to the sample. `mean_change` (T) is its
    mean over the thickness, `equivalent_depth` (m) half the thickness x mean / surface value.
    `x`, `y` (m) are the centres of the elements, `steady` and `alternating` |B| (T) there, shape (y, x).
    """

    depth: FloatArray
    change: FloatArray
    mean_change: float
    equivalent_depth: float
    permeability: float
    x: FloatArray
    y: FloatArray
    steady: FloatArray
    alternating: FloatArray


def plate_field(
    coil: RippleCoil,
    actuator: ReluctanceActuator,
    current: float,
    gap: float,
    finest: float = 4e-6,
    periods: int = 4,
) -> PlateField:
    """Return the field at mean `current` (A) and `gap` (m); raises `FieldError` if the iteration fails.

    The winding drives the plate to the same mean flux density in its middle as the magnetic circuit of
    `actuator` has at this current, so both computations speak of the same state of the iron. `finest` (m) is
    the width of the elements at the surface.
    """
    plate = _Plate(coil, actuator, gap, finest)
    steady = plate.steady_field(float(core_flux_density(actuator, current, gap)))
    go = plate.march(plate.matrices(steady)[1])
    plus, period, delay = duty(coil, current), coil.pwm_period, coil.sample_delay
    on, off = plus * period, (1.0 - plus) * period
    # the bridge imposes the rate of the mean flux density
    rate = 2.0 * coil.link_voltage / (actuator.turns * actuator.gap_area)
    rise, fall = rate * (1.0 - plus), -rate * plus
    # starting in the middle of a rise, the density has no mean from the first period on
    go(rise, 0.5 * on)
    for _ in range(periods):
        before = go(fall, off)
        change = go(rise, delay) - before
        go(rise, on - delay)
    depth, profile = plate.profile(change)
    mean = plate.mean(change)
    return PlateField(
        depth=depth,
        change=profile,
        mean_change=mean,
        equivalent_depth=plate.half * mean / float(profile[0]),
        permeability=1.0 / float(plate.curve(plate.mean(steady))[1]),
        x=plate.x,
        y=plate.y,
        steady=plate.density(steady),
        alternating=plate.density(change),
    )


class _Plate:
    """Mesh and matrices of half a plate with half its gap, and the fields on them."""

    def __init__(self, coil: RippleCoil, actuator: ReluctanceActuator, gap: float, finest: float):
        self.coil, self.actuator = coil, actuator
        self.half = half = coil.plate_half_thickness
        edge, length = 0.5 * (gap + actuator.residual_gap), 0.25 * actuator.core_length
        # fine at the surface of the plate and at its end
        x = np.concatenate(
            [(half - _graded(half, finest))[::-1], half + _graded(_AIR_WIDTH, 4.0 * finest)[1:]]
        )
        y = np.concatenate([np.linspace(0.0, edge, 9), edge + _graded(length, 8.0 * finest)[1:]])
        mesh, element = MeshQuad.init_tensor(x, y), ElementQuad2()
        self.basis = Basis(mesh, element)
        self.centre = Basis(mesh, element, quadrature=(np.full((2, 1), 0.5), np.ones(1)))
        across, along = mesh.p[:, mesh.t].mean(axis=1)
        self.x, self.y = 0.5 * (x[1:] + x[:-1]), 0.5 * (y[1:] + y[:-1])
        self.rows = np.lexsort((across, along)).reshape(self.y.size, self.x.size)
        middle = int(np.searchsorted(y, edge + 0.5 * length)) - 1
        # two Gauss points across each element of the iron's middle row, where the gradient is most exact
        points = np.array([(0.5, 0.5), _GAUSS]), np.full(2, 0.5)
        self.line = Basis(mesh, element, quadrature=points, elements=self.rows[middle, self.x < half])
        self.iron = self._per_point((across < half) & (along > edge))
        wound = (across > half + _WINDING_INSIDE) & (across < half + _WINDING_OUTSIDE)
        wound &= along > edge + _WINDING_START
        winding = _load.assemble(self.basis, inside=self._per_point(wound.astype(float)))
        self.winding = winding / winding.sum()
        self.axis = self.basis.get_dofs(lambda p: p[0] < 1e-12).all()
        surface = self.basis.get_dofs(lambda p: np.isclose(p[0], half, atol=1e-9)).all()
        height = np.abs(self.basis.doflocs[1, surface] - self.y[middle])
        self.surface_node = surface[np.argmin(height)]

    def steady_field(self, flux_density: float) -> FloatArray:
        """Return A with this mean flux density (T) in the middle of the plate, by Newton's steps."""
        potential, tension = np.zeros(self.basis.N), 0.0
        for _ in range(_MOST_STEPS):
            secant, tangent = self.matrices(potential)
            lacking = tension * self.winding - secant @ potential
            step, more = self._solver(tangent)(lacking, flux_density - self.mean(potential))
            potential, tension = potential + step, tension + more
            if np.linalg.norm(step) <= _SAME_FIELD * np.linalg.norm(potential):
                return potential
        raise FieldError(f'the steady field did not settle in {_MOST_STEPS} steps; use a smaller current')

    def _solver(self, matrix: Any) -> Callable[[FloatArray, float], tuple[FloatArray, float]]:
        """Return what solves a system for A, 0 on the axis, and the tension (A) that gives a mean (T)."""
        sensed = csc_matrix(([1.0 / self.half], ([0], [self.surface_node])), shape=(1, self.basis.N))
        within = enforce(matrix.tocsr(), D=self.axis)
        whole = bmat([[within, -csc_matrix(self.winding[:, np.newaxis])], [sensed, None]], format='csc')
        factors = splu(whole)

        def solve(right: FloatArray, mean: float) -> tuple[FloatArray, float]:
            right[self.axis] = 0.0
            found = factors.solve(np.append(right, mean))
            return found[:-1], float(found[-1])

        return solve

    def matrices(self, potential: FloatArray) -> tuple[Any, Any]:
        """Return the matrix that gives the flow of a field, and that of a small field about it."""
        gradient = self.basis.interpolate(potential).grad
        square = (gradient**2).sum(axis=0)
        secant, slope = (np.where(self.iron, each, 1.0 / MU_0) for each in self.curve(np.sqrt(square)))
        along = (slope - secant) / np.maximum(square, 1e-30)
        return tuple(
            _tensor.assemble(self.basis, across=secant, along=each, g=gradient)
            for each in (0.0 * along, along)
        )

    def curve(self, density: Any) -> tuple[Any, Any]:
        """Return H/B and dH/dB (m/H) of the core at a flux density (T)."""
        a = self.actuator
        linear = MU_0 * a.knee_field + a.saturation_polarisation - density
        field = (-linear + np.sqrt(linear**2 + 4.0 * MU_0 * density * a.knee_field)) / (2.0 * MU_0)
        knee = a.knee_field + field
        slope = 1.0 / (MU_0 + a.saturation_polarisation * a.knee_field / knee**2)
        return 1.0 / (MU_0 + a.saturation_polarisation / knee), slope

    def march(self, stiffness: Any) -> Callable[[float, float], FloatArray]:
        """Return what takes rate (T/s) of the mean flux density and duration (s), and returns A behind it.

        Steps of the linear alternating field from 0 on, by a stiffly accurate method of second order. The
        mean flux density is imposed; the tension of the winding is whatever that takes.
        """
        mass = _mass.assemble(self.basis, sigma=self.coil.conductivity * self.iron)
        solvers: dict[float, Any] = {}
        inner, density = np.zeros(self.basis.N), 0.0

        def go(rate: float, duration: float) -> FloatArray:
            nonlocal inner, density
            dt = duration / _STEPS
            weight = mass / (_GAMMA * dt)
            solve = solvers.get(dt) or solvers.setdefault(dt, self._solver(weight + stiffness))
            for step in range(_STEPS):
                half_way, _ = solve(weight @ inner, density + rate * (step + _GAMMA) * dt)
                start = inner + (1.0 - _GAMMA) / _GAMMA * (half_way - inner)
                inner, _ = solve(weight @ start, density + rate * (step + 1) * dt)
            density += rate * duration
            return inner

        return go

    def mean(self, potential: FloatArray) -> float:
        """Return the mean flux density (T) in the middle of the plate."""
        return float(potential[self.surface_node] / self.half)

    def profile(self, potential: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return depths (m) and dA/dx (T) across the middle of the plate, surface first.

        Within the elements at Gauss points; at the surface by a straight line through the two nearest.
        """
        depth = self.half - np.asarray(self.line.global_coordinates()[0]).ravel()
        order = np.argsort(depth)
        depth, density = depth[order], self.line.interpolate(potential).grad[0].ravel()[order]
        slope = (density[1] - density[0]) / (depth[1] - depth[0])
        return np.append(0.0, depth), np.append(density[0] - slope * depth[0], density)

    def density(self, potential: FloatArray) -> FloatArray:
        """Return |B| (T) at the centres of the elements, shape (y, x)."""
        gradient = self.centre.interpolate(potential).grad[:, :, 0]
        return np.asarray(np.hypot(*gradient)[self.rows], np.float64)

    def _per_point(self, values: Any) -> Any:
        """Return one value of each element at all its points."""
        return np.repeat(values[:, np.newaxis], self.basis.X.shape[-1], axis=1)


def _graded(length: float, first: float) -> FloatArray:
    """Return 0 .. `length` in steps that grow from about `first`, up to a twelfth of the length."""
    steps = [first]
    while sum(steps) < length:
        steps.append(min(steps[-1] * _GROWTH, length / 12.0))
    return np.concatenate([[0.0], np.cumsum(steps)]) * (length / sum(steps))


@BilinearForm
def _tensor(u: Any, v: Any, w: Any) -> Any:
    """across grad(u) . grad(v) + along (g . grad(u)) (g . grad(v))."""
    return w['across'] * dot(u.grad, v.grad) + w['along'] * dot(w['g'], u.grad) * dot(w['g'], v.grad)


_mass = BilinearForm(lambda u, v, w: w['sigma'] * u * v)
_load = LinearForm(lambda v, w: w['inside'] * v)
