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
from skfem import Basis, BilinearForm, ElementQuad2, LinearForm, MeshQuad
from skfem.helpers import dot

from engine_mount.reports.drive.signals import FloatArray
from mount_sim.plant.reluctance import MU_0, ReluctanceActuator, core_flux_density
from mount_sim.plant.ripple import RippleCoil, duty

_MOST_STEPS = 60
_SAME_FIELD = 1e-9
_LEAST_SHARE = 1e-3
_STEPS = 16  # in each part of the period
_GAMMA = 1.0 - 0.5**0.5
_GAUSS = (0.5 - 12.0**-0.5, 0.5 + 12.0**-0.5)
_GROWTH = 1.25  # of the elements, away from a surface


class FieldError(ValueError):
    """The finite-element computation did not come to an end; the text says where and the remedy."""


@dataclass(frozen=True)
class PlateSurroundings:
    """Air and winding beside the plate, and the mesh; m, chosen."""

    air_width: float = 10e-3
    winding_distance: float = 0.5e-3  # from the plate
    winding_thickness: float = 3e-3
    winding_start: float = 8e-3  # from the gap
    finest: float = 4e-6  # width of the elements at the surface


@dataclass(frozen=True)
class PlateField:
    """The field at one mean current.

    `depth` (m, from the surface) and `change` (T) are of shape (n,): the alternating flux density at the
    middle of the plate's length, as it has changed from switching to the sample. `mean_change` (T) is its
    mean over the thickness, `equivalent_depth` (m) half the thickness x mean / surface value;
    `path_depth` (m) the same for the magnetic tension along all of the plate instead of this section.
    `x`, `y` (m) are the centres of the elements, `steady` and `alternating` |B| (T) there, shape (y, x).
    `drift` is the relative change of the surface value over the last period: 0 in the periodic state.
    """

    depth: FloatArray
    change: FloatArray
    mean_change: float
    equivalent_depth: float
    path_depth: float
    permeability: float
    x: FloatArray
    y: FloatArray
    steady: FloatArray
    alternating: FloatArray
    drift: float


def plate_field(
    coil: RippleCoil,
    actuator: ReluctanceActuator,
    current: float,
    gap: float,
    surroundings: PlateSurroundings = PlateSurroundings(),
    periods: int = 4,
) -> PlateField:
    """Return the field at mean `current` (A) and `gap` (m); raises `FieldError` if the iteration fails.

    The winding drives the plate to the same mean flux density in its middle as the magnetic circuit of
    `actuator` has at this current, so both computations speak of the same state of the iron.
    """
    plate = _Plate(coil, actuator, gap, surroundings)
    steady = plate.steady_field(float(core_flux_density(actuator, current, gap)))
    go = plate.march(plate.stiffness(steady))
    plus, period, delay = duty(coil, current), coil.pwm_period, coil.sample_delay
    on, off = plus * period, (1.0 - plus) * period
    # the bridge imposes the rate of the mean flux density
    rate = 2.0 * coil.link_voltage / (actuator.turns * actuator.gap_area)
    rise, fall = rate * (1.0 - plus), -rate * plus
    # starting in the middle of a rise, the density has no mean from the first period on
    go(rise, 0.5 * on)
    surface = []
    for _ in range(periods):
        before = go(fall, off)
        change = go(rise, delay) - before
        go(rise, on - delay)
        depth, profile = plate.profile(change, plate.middle)
        surface.append(profile[0])
    mean = float(change[plate.surface_node] / plate.half)
    slope = float(plate.curve(float(steady[plate.surface_node]) / plate.half)[1])
    # the alternating field strength along the surface, A/m
    field = [
        plate.profile(change, row)[1][0]
        * plate.curve(abs(float(plate.profile(steady, row)[1][1:3].mean())))[1]
        for row in plate.rows_of_iron.tolist()
    ]
    tension = float(np.average(field, weights=plate.heights[plate.rows_of_iron]))
    return PlateField(
        depth=depth,
        change=profile,
        mean_change=mean,
        equivalent_depth=plate.half * mean / float(profile[0]),
        path_depth=plate.half * mean * slope / tension,
        permeability=1.0 / slope,
        x=plate.x,
        y=plate.y,
        steady=plate.density(steady),
        alternating=plate.density(change),
        drift=float(abs(surface[-1] / surface[-2] - 1.0)) if periods > 1 else float('nan'),
    )


class _Plate:
    """Mesh and matrices of half a plate with half its gap, and the fields on them."""

    def __init__(self, coil: RippleCoil, actuator: ReluctanceActuator, gap: float, around: PlateSurroundings):
        self.coil, self.actuator = coil, actuator
        self.half = half = coil.plate_half_thickness
        edge, length = 0.5 * (gap + actuator.residual_gap), 0.25 * actuator.core_length
        # fine at the surface of the plate and at its end
        outwards = half + _graded(around.air_width, 4.0 * around.finest)[1:]
        x = np.concatenate([(half - _graded(half, around.finest))[::-1], outwards])
        upwards = edge + _graded(length, 8.0 * around.finest)[1:]
        y = np.concatenate([np.linspace(0.0, edge, 9), upwards])
        mesh = MeshQuad.init_tensor(x, y)
        self.basis = Basis(mesh, ElementQuad2())
        # two Gauss points across each element, where the gradient is most exact, and its centre
        self.line = Basis(mesh, self.basis.elem, quadrature=(np.array([(0.5, 0.5), _GAUSS]), np.full(2, 0.5)))
        self.centre = Basis(mesh, self.basis.elem, quadrature=(np.full((2, 1), 0.5), np.ones(1)))
        across, along = mesh.p[:, mesh.t].mean(axis=1)
        self.x, self.y, self.heights = 0.5 * (x[1:] + x[:-1]), 0.5 * (y[1:] + y[:-1]), np.diff(y)
        self.rows = np.lexsort((across, along)).reshape(self.y.size, self.x.size)
        self.columns_of_iron = np.flatnonzero(self.x < half)
        self.rows_of_iron = np.flatnonzero(self.y > edge)
        self.iron = self._per_point((across < half) & (along > edge))
        distance = across - half - around.winding_distance
        wound = (distance > 0.0) & (distance < around.winding_thickness)
        wound &= along > edge + around.winding_start
        winding = _load.assemble(self.basis, inside=self._per_point(wound.astype(float)))
        self.free = self.basis.complement_dofs(self.basis.get_dofs(lambda p: p[0] < 1e-12))
        self.winding = (winding / winding.sum())[self.free]
        self.middle = int(np.searchsorted(y, edge + 0.5 * length)) - 1
        surface = self.basis.get_dofs(lambda p: np.isclose(p[0], half, atol=1e-9)).all()
        height = np.abs(self.basis.doflocs[1, surface] - self.y[self.middle])
        self.surface_node = int(surface[np.argmin(height)])

    def steady_field(self, flux_density: float) -> FloatArray:
        """Return A with this mean flux density (T) in the middle of the plate, by damped Newton steps."""
        if flux_density == 0.0:
            return np.zeros(self.basis.N)
        nothing = np.zeros(self.free.size)
        found = self._factors(self.stiffness(self._whole(nothing))).solve(np.append(nothing, flux_density))
        for _ in range(_MOST_STEPS):
            potential, residual = self._whole(found[:-1]), self._residual(found)
            size = np.linalg.norm(residual)
            if size < _SAME_FIELD * abs(found[-1]) * np.linalg.norm(self.winding):
                return potential
            step = self._factors(self.stiffness(potential)).solve(np.append(-residual, 0.0))
            share = 1.0
            while share > _LEAST_SHARE and np.linalg.norm(self._residual(found + share * step)) >= size:
                share *= 0.5
            found = found + share * step
        raise FieldError(f'the steady field did not settle in {_MOST_STEPS} steps; use a smaller current')

    def _whole(self, free: FloatArray) -> FloatArray:
        """Return A at all nodes."""
        potential = np.zeros(self.basis.N)
        potential[self.free] = free
        return potential

    def _factors(self, matrix: Any) -> Any:
        """Return the factors of a system whose last unknown is the tension (A), its last row the mean (T)."""
        place = np.flatnonzero(self.free == self.surface_node)
        sensed = csc_matrix(([1.0 / self.half], ([0], place)), shape=(1, self.free.size))
        within = matrix[self.free][:, self.free]
        return splu(bmat([[within, -csc_matrix(self.winding[:, np.newaxis])], [sensed, None]], format='csc'))

    def _residual(self, found: FloatArray) -> FloatArray:
        gradient = self.basis.interpolate(self._whole(found[:-1])).grad
        flow = _flow.assemble(self.basis, flow=self._reluctivities(gradient)[0] * gradient)
        return np.asarray(flow[self.free] - found[-1] * self.winding, np.float64)

    def stiffness(self, potential: FloatArray) -> Any:
        """Return the matrix of the small field about the field `potential`."""
        gradient = self.basis.interpolate(potential).grad
        secant, slope = self._reluctivities(gradient)
        square = np.maximum((gradient**2).sum(axis=0), 1e-30)
        return _tensor.assemble(self.basis, across=secant, along=(slope - secant) / square, g=gradient)

    def _reluctivities(self, gradient: FloatArray) -> list[FloatArray]:
        """Return H/B and dH/dB (m/H) at each point, of the core's magnetisation curve or of air."""
        curve = self.curve(np.sqrt((gradient**2).sum(axis=0)))
        return [np.where(self.iron, each, 1.0 / MU_0) for each in curve]

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
        free_mass = mass[self.free][:, self.free]
        factors: dict[float, Any] = {}
        inner, density = np.zeros(self.free.size), 0.0

        def stage(dt: float, start: FloatArray, imposed: float) -> FloatArray:
            right = np.append(free_mass @ start / (_GAMMA * dt), imposed)
            return np.asarray(factors[dt].solve(right)[:-1], np.float64)

        def go(rate: float, duration: float) -> FloatArray:
            nonlocal inner, density
            dt = duration / _STEPS
            if dt not in factors:
                factors[dt] = self._factors(mass / (_GAMMA * dt) + stiffness)
            for step in range(_STEPS):
                half_way = stage(dt, inner, density + rate * (step + _GAMMA) * dt)
                start = inner + (1.0 - _GAMMA) / _GAMMA * (half_way - inner)
                inner = stage(dt, start, density + rate * (step + 1) * dt)
            density += rate * duration
            return self._whole(inner)

        return go

    def profile(self, potential: FloatArray, row: int) -> tuple[FloatArray, FloatArray]:
        """Return depths (m) and dA/dx (T) across the plate in a row of elements, surface first.

        Within the elements at Gauss points; at the surface by a straight line through the two nearest.
        """
        elements = self.rows[row, self.columns_of_iron]
        x = np.asarray(self.line.global_coordinates()[0])[elements].ravel()
        order = np.argsort(-x)
        depth = self.half - x[order]
        density = self.line.interpolate(potential).grad[0][elements].ravel()[order]
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
_flow = LinearForm(lambda v, w: dot(w['flow'], v.grad))
_load = LinearForm(lambda v, w: w['inside'] * v)
