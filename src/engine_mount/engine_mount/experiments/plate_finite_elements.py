"""The ripple's field in a plate with its air gap by two-dimensional finite elements: checks `plate_field`.

Planar, one plate by itself, a quarter of the circuit: half a plate, half a gap, a quarter of the path.
Unknown is the vector potential A with B = (-dA/dy, dA/dx); x runs from the middle of the plate outwards, y
from the middle of the gap along the plate. First the nonlinear steady field of the mean current, then the
small alternating field about it, with the slope of the magnetisation curve where it stands and eddy currents
in the iron. Imposed is the mean flux density in the middle of the plate, the same triangle as in
`plate_field`, so that both answer the same question; the current follows. With the linkage of the winding
imposed instead, the air beside the plate would take its share, which depends on the winding chosen here.
"""

from dataclasses import dataclass
from typing import Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.sparse import bmat, csc_matrix
from scipy.sparse.linalg import splu
from skfem import Basis, BilinearForm, ElementQuad2, LinearForm, MeshQuad, condense, solve

from mount_models.quantity import Quantity
from mount_sim.plant.reluctance import MU_0, ReluctanceActuator, core_flux_density
from mount_sim.plant.ripple import RippleCoil, duty

FloatArray = npt.NDArray[np.float64]


class FieldError(ValueError):
    """The finite-element computation did not come to an end; the text says where and the remedy."""


class PlateSurroundings(NamedTuple):
    """Air and winding beside the plate, and the mesh."""

    air_width: Annotated[float, Quantity('m', 'width of the air beside the plate', 5e-3, 0.1)] = 10e-3
    winding_distance: Annotated[float, Quantity('m', 'from the plate to the winding', 0.0, 5e-3)] = 0.5e-3
    winding_thickness: Annotated[float, Quantity('m', 'thickness of the winding', 1e-4, 5e-3)] = 3e-3
    winding_start: Annotated[float, Quantity('m', 'from the gap to the winding', 0.0, 2e-2)] = 8e-3
    finest: Annotated[float, Quantity('m', 'width of the elements at the surface', 1e-6, 1e-4)] = 4e-6


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
    surroundings: PlateSurroundings | None = None,
    periods: int = 4,
) -> PlateField:
    """Return the field at mean `current` (A) and `gap` (m); raises `FieldError` if the iteration fails.

    The winding drives the plate to the same mean flux density in its middle as the magnetic circuit of
    `actuator` has at this current, so both computations speak of the same state of the iron.
    """
    plate = _Plate(coil, actuator, gap, surroundings or PlateSurroundings())
    steady = plate.steady_state(float(core_flux_density(actuator, current, gap)))
    return plate.alternating_field(steady, current, periods)


class _Plate:
    """Mesh, matrices and what is measured on them."""

    def __init__(self, coil: RippleCoil, actuator: ReluctanceActuator, gap: float, around: PlateSurroundings):
        self.coil, self.actuator = coil, actuator
        self.half = coil.plate_half_thickness
        self.edge = 0.5 * (gap + actuator.residual_gap)
        self.length = 0.25 * actuator.core_length
        x, y = _grid(self.half, self.edge, self.length, around)
        self.shape = (y.size - 1, x.size - 1)
        self.mesh = MeshQuad.init_tensor(x, y)
        self.basis = Basis(self.mesh, ElementQuad2())
        centre = self.mesh.p[:, self.mesh.t].mean(axis=1)
        self.iron = (centre[0] < self.half) & (centre[1] > self.edge)
        wound = (centre[0] > self.half + around.winding_distance) & (
            centre[0] < self.half + around.winding_distance + around.winding_thickness
        )
        wound &= centre[1] > self.edge + around.winding_start
        self.order = np.lexsort((centre[0], centre[1]))
        self.heights = np.diff(y)
        self.x, self.y = 0.5 * (x[1:] + x[:-1]), 0.5 * (y[1:] + y[:-1])
        element = self.basis.elem
        line = np.array([_GAUSS, (0.5, 0.5)])
        if np.ptp(self.mesh.mapping().F(line)[0, 0]) < 0.1 * (x[1] - x[0]):
            line = line[::-1]  # the elements' own first direction is y
        self.line = Basis(self.mesh, element, quadrature=(line, np.array([0.5, 0.5])))
        self.points = np.asarray(self.line.global_coordinates()[0])
        self.centre = Basis(self.mesh, element, quadrature=(np.array([[0.5], [0.5]]), np.array([1.0])))
        self.fixed = self.basis.get_dofs(lambda p: p[0] < 1e-12).all()
        winding = _load.assemble(self.basis, inside=self._per_point(wound.astype(float)))
        self.winding = winding / winding.sum()
        middle = self.edge + 0.5 * self.length
        self.middle_row = int(np.searchsorted(y, middle)) - 1
        surface = self.basis.get_dofs(lambda p: np.isclose(p[0], self.half, atol=1e-9))
        nodes = surface.all()
        self.surface_node = int(
            nodes[
                np.argmin(
                    np.abs(self.basis.doflocs[1, nodes] - y[self.middle_row : self.middle_row + 2].mean())
                )
            ]
        )

    def steady_state(self, flux_density: float) -> FloatArray:
        """Return A of the steady field with this mean flux density (T) in the middle of the plate."""
        potential = np.zeros(self.basis.N)
        if flux_density == 0.0:
            return potential
        # the tension of the circuit is a good start; the flux grows with it, so a secant finds it
        tension = flux_density * self.edge / MU_0
        last = (0.0, 0.0)
        for _ in range(_MOST_STEPS):
            potential = self._magnetised(potential, tension)
            reached = potential[self.surface_node] / self.half
            if abs(reached - flux_density) < _SAME_FLUX * flux_density:
                return potential
            slope = (reached - last[1]) / (tension - last[0])
            last = (tension, reached)
            tension += (flux_density - reached) / slope
        raise FieldError(
            f'the winding found no tension for {flux_density:.2f} T in {_MOST_STEPS} steps; ask for less'
        )

    def _magnetised(self, start: FloatArray, tension: float) -> FloatArray:
        """Return A at a tension (A) of the quarter circuit by Newton's method with halved steps."""
        potential, load = start, tension * self.winding
        residual = self._residual(potential, load)
        for _ in range(_MOST_STEPS):
            if np.linalg.norm(residual) < _SAME_FIELD * np.linalg.norm(load):
                return potential
            step = solve(*condense(self._stiffness(potential), -residual, D=self.fixed))
            share = 1.0
            while True:
                tried = potential + share * step
                left = self._residual(tried, load)
                if np.linalg.norm(left) < np.linalg.norm(residual) or share < _LEAST_SHARE:
                    break
                share *= 0.5
            potential, residual = tried, left
        raise FieldError(f'the steady field did not settle in {_MOST_STEPS} steps; use a smaller current')

    def _residual(self, potential: FloatArray, load: FloatArray) -> FloatArray:
        gradient = self.basis.interpolate(potential).grad
        secant, _ = self._reluctivities(gradient)
        residual = _flow.assemble(self.basis, flow=secant * gradient) - load
        residual[self.fixed] = 0.0
        return np.asarray(residual, np.float64)

    def _stiffness(self, potential: FloatArray) -> Any:
        gradient = self.basis.interpolate(potential).grad
        secant, slope = self._reluctivities(gradient)
        square = np.maximum((gradient**2).sum(axis=0), 1e-30)
        return _tensor.assemble(self.basis, across=secant, along=(slope - secant) / square, g=gradient)

    def _reluctivities(self, gradient: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return H/B and dH/dB (m/H) at each point, of the core's magnetisation curve or of air."""
        density = np.sqrt((gradient**2).sum(axis=0))
        a = self.actuator
        linear = MU_0 * a.knee_field + a.saturation_polarisation - density
        field = (-linear + np.sqrt(linear**2 + 4.0 * MU_0 * density * a.knee_field)) / (2.0 * MU_0)
        knee = a.knee_field + field
        slope = 1.0 / (MU_0 + a.saturation_polarisation * a.knee_field / knee**2)
        secant = 1.0 / (MU_0 + a.saturation_polarisation / knee)
        iron = self._per_point(self.iron.astype(float)) > 0.5
        return np.where(iron, secant, 1.0 / MU_0), np.where(iron, slope, 1.0 / MU_0)

    def alternating_field(self, steady: FloatArray, current: float, periods: int) -> PlateField:
        """Return the field with the ripple on top of the steady one, in the periodic state."""
        stiffness = self._stiffness(steady)
        mass = _mass.assemble(self.basis, sigma=self._per_point(self.coil.conductivity * self.iron))
        sensed = np.zeros(self.basis.N)
        sensed[self.surface_node] = 1.0 / self.half
        march = _March(stiffness, mass, self.winding, sensed, self.fixed)
        plus, period = duty(self.coil, current), self.coil.pwm_period
        on, off, delay = plus * period, (1.0 - plus) * period, self.coil.sample_delay
        # the bridge imposes the rate of the mean flux density
        rate = 2.0 * self.coil.link_voltage / (self.actuator.turns * self.actuator.gap_area)
        rise, fall = rate * (1.0 - plus), -rate * plus
        potential = np.zeros(self.basis.N)
        # starting in the middle of a rise, the density has no mean from the first period on
        potential, density = march.go(potential, 0.0, rise, 0.5 * on, _STEPS)
        before = after = potential
        changes = []
        for _ in range(periods):
            before, density = march.go(potential, density, fall, off, _STEPS)
            after, density = march.go(before, density, rise, delay, _STEPS)
            potential, density = march.go(after, density, rise, on - delay, _STEPS)
            changes.append(self._profile(after - before)[1][0])
        change = after - before
        depth, profile = self._profile(change)
        mean = float(change[self.surface_node] / self.half)
        slope = self._slope(float(steady[self.surface_node]) / self.half)
        return PlateField(
            depth=depth,
            change=profile,
            mean_change=mean,
            equivalent_depth=self.half * mean / float(profile[0]),
            path_depth=self.half * mean * slope / self._mean_surface_field(change, steady),
            permeability=1.0 / slope,
            x=self.x,
            y=self.y,
            steady=self._density(steady),
            alternating=self._density(change),
            drift=float(abs(changes[-1] / changes[-2] - 1.0)) if periods > 1 else float('nan'),
        )

    def _profile(self, potential: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return depths (m) and dA/dx (T) across the plate in the middle of its length, surface first.

        Inside the elements at Gauss points, where the gradient is most exact; at the surface by a
        straight line through the two nearest.
        """
        row = self._row_of_iron(self.middle_row)
        x, density = self.points[row].ravel(), self._at_gauss_points(potential)[row].ravel()
        order = np.argsort(-x)
        depth, density = self.half - x[order], density[order]
        slope = (density[1] - density[0]) / (depth[1] - depth[0])
        return np.append(0.0, depth), np.append(density[0] - slope * depth[0], density)

    def _mean_surface_field(self, change: FloatArray, steady: FloatArray) -> float:
        """Return the alternating field strength (A/m) along the surface, averaged over the plate's length."""
        total = length = 0.0
        density, base = self._at_gauss_points(change), self._at_gauss_points(steady)
        for number, height in enumerate(self.heights):
            row = self._row_of_iron(number)
            if row.size:
                outermost = row[-1]
                near = np.argsort(-self.points[outermost])
                depth = self.half - self.points[outermost][near]
                at = density[outermost][near]
                surface = at[0] - (at[1] - at[0]) / (depth[1] - depth[0]) * depth[0]
                total += height * surface * self._slope(abs(float(base[outermost].mean())))
                length += height
        return total / length

    def _row_of_iron(self, number: int) -> npt.NDArray[np.int64]:
        """Return the elements of one row inside the plate, from the middle outwards."""
        row = self.order.reshape(self.shape)[number]
        return np.asarray(row[self.iron[row]], np.int64)

    def _at_gauss_points(self, potential: FloatArray) -> FloatArray:
        return np.asarray(self.line.interpolate(potential).grad[0], np.float64)

    def _slope(self, density: float) -> float:
        """Return dH/dB (m/H) of the core at a flux density (T)."""
        a = self.actuator
        linear = MU_0 * a.knee_field + a.saturation_polarisation - density
        field = (-linear + np.sqrt(linear**2 + 4.0 * MU_0 * density * a.knee_field)) / (2.0 * MU_0)
        return float(1.0 / (MU_0 + a.saturation_polarisation * a.knee_field / (a.knee_field + field) ** 2))

    def _density(self, potential: FloatArray) -> FloatArray:
        """Return |B| (T) at the centres of the elements, shape (y, x)."""
        gradient = self.centre.interpolate(potential).grad[:, :, 0]
        return np.asarray(np.hypot(*gradient)[self.order].reshape(self.shape), np.float64)

    def _per_point(self, values: FloatArray) -> FloatArray:
        """Return one value of each element at all its points."""
        return np.repeat(values[:, np.newaxis], self.basis.X.shape[-1], axis=1)


class _March:
    """Steps of the linear alternating field, by a stiffly accurate method of second order.

    What is imposed is a weighted sum of A, `sensed`; the tension of the winding is whatever that takes.
    """

    def __init__(
        self,
        stiffness: Any,
        mass: Any,
        winding: FloatArray,
        sensed: FloatArray,
        fixed: npt.NDArray[np.int64],
    ):
        free = np.setdiff1d(np.arange(winding.size), fixed)
        self._free, self._winding, self._sensed = free, winding[free], sensed[free]
        self._stiffness, self._mass = stiffness[free][:, free], mass[free][:, free]
        self._factors: dict[float, _Solver] = {}

    def go(
        self, potential: FloatArray, imposed: float, rate: float, duration: float, steps: int
    ) -> tuple[FloatArray, float]:
        """Return A and the imposed sum after `duration` (s), in which that grows from `imposed` at `rate`."""
        dt = duration / steps
        solver = self._solver(_GAMMA * dt)
        inner = potential[self._free]
        for step in range(steps):
            half_way = self._stage(solver, inner, imposed + rate * (step + _GAMMA) * dt)
            start = inner + (1.0 - _GAMMA) / _GAMMA * (half_way - inner)
            inner = self._stage(solver, start, imposed + rate * (step + 1) * dt)
        result = np.zeros_like(potential)
        result[self._free] = inner
        return result, imposed + rate * duration

    def _stage(self, solver: '_Solver', start: FloatArray, imposed: float) -> FloatArray:
        right = np.append(self._mass @ start / solver.step, imposed)
        return np.asarray(solver.factor.solve(right)[:-1], np.float64)

    def _solver(self, step: float) -> '_Solver':
        if step not in self._factors:
            column, row = csc_matrix(self._winding[:, np.newaxis]), csc_matrix(self._sensed[np.newaxis])
            matrix = bmat([[self._mass / step + self._stiffness, -column], [row, None]], format='csc')
            self._factors[step] = _Solver(step, splu(matrix))
        return self._factors[step]


@dataclass(frozen=True)
class _Solver:
    step: float
    factor: Any


_MOST_STEPS = 60
_SAME_FLUX = 1e-6
_SAME_FIELD = 1e-9
_LEAST_SHARE = 1e-3
_STEPS = 16  # in each part of the period
_GAMMA = 1.0 - 0.5**0.5
_GAUSS = (0.5 - 12.0**-0.5, 0.5 + 12.0**-0.5)
_GROWTH = 1.25  # of the elements, away from a surface


def _grid(
    half: float, edge: float, length: float, around: PlateSurroundings
) -> tuple[FloatArray, FloatArray]:
    """Return the lines of the mesh: fine at the surface of the plate and at its end."""
    inwards = _graded(half, around.finest)
    outwards = _graded(around.air_width, 4.0 * around.finest)
    upwards = _graded(length, 8.0 * around.finest)
    gap = np.linspace(0.0, edge, 9)
    x = np.concatenate([(half - inwards)[::-1], half + outwards[1:]])
    return x, np.concatenate([gap, edge + upwards[1:]])


def _graded(length: float, first: float) -> FloatArray:
    """Return 0 .. `length` in steps that grow from about `first`, up to a twelfth of the length."""
    steps = [first]
    while sum(steps) < length:
        steps.append(min(steps[-1] * _GROWTH, length / 12.0))
    return np.concatenate([[0.0], np.cumsum(steps)]) * (length / sum(steps))


@BilinearForm
def _tensor(u: Any, v: Any, w: Any) -> Any:
    """across grad(u) . grad(v) + along (g . grad(u)) (g . grad(v))."""
    plain = u.grad[0] * v.grad[0] + u.grad[1] * v.grad[1]
    directed = (w['g'][0] * u.grad[0] + w['g'][1] * u.grad[1]) * (
        w['g'][0] * v.grad[0] + w['g'][1] * v.grad[1]
    )
    return w['across'] * plain + w['along'] * directed


@BilinearForm
def _mass(u: Any, v: Any, w: Any) -> Any:
    return w['sigma'] * u * v


@LinearForm
def _flow(v: Any, w: Any) -> Any:
    return w['flow'][0] * v.grad[0] + w['flow'][1] * v.grad[1]


@LinearForm
def _load(v: Any, w: Any) -> Any:
    return w['inside'] * v
