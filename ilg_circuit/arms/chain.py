"""The arm as a chain of arcs: no shear, no change of length, one angle a segment, exact for curvature constant in each.

Segment k is an arc from the angle theta_k-1 to theta_k, so that the chain can take any free curvature kappa_k that is
constant in each segment. Its moment is EI [(theta_k - theta_k-1)/l - kappa_k + c rate of the first term], and

    M(theta) theta'' = (virtual work of weight, drag, contact, load and of -m times the centripetal acceleration)
                       - difference of the moments at both sides of a joint

with masses at the ends and middles of arcs by Simpson's rule. Positions are complex numbers x + i y here; arrays may
have time in front. Written in numpy: nothing is compiled, and n angles are half as many unknowns as a lattice has.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.polynomial.legendre import leggauss
from numpy.typing import NDArray

from ..arrays import Array, ComplexArray, one_thread
from ..errors import SolveError
from ..simulation.curvature import cells_of

#: Gauss points in half an arc: exact to 1e-10 of it for a turn of one radian in an arc.
_POINTS = 4
#: Steps of the search for an equilibrium; largest turn in a step [rad], and the turn that is the last.
_STEPS, _TURN, _SMALL = 2000, 0.3, 1e-11


@dataclass(frozen=True)
class Contact:
    """A plane that pushes back on the faces, as `lattice.Plane`; a point on it and its normal as complex numbers."""

    point: complex
    normal: complex
    stiffness: float
    damping: float


@dataclass(frozen=True, eq=False)
class Chain:
    """A chain of n arcs, clamped at the angle ``base`` [rad].

    ``lengths`` [m], ``stiffness`` EI [N m^2], ``mass`` per length [kg/m] of each arc (n,), ``thickness`` [m] at its far
    end; ``loss`` [s] is c; ``weight`` [m/s^2] the acceleration of gravity. ``drag`` (n, 2) is 1/2 rho c S along and
    across. At ``place`` [m] there is a mass [kg], and a spring [N/m] and a dashpot [N s/m] along y, the spring from
    ``rest`` [m]; ``pull`` [N], such as a load's weight, acts at the free end.
    """

    lengths: Array
    stiffness: Array
    mass: Array
    thickness: Array
    base: float = 0.0
    loss: float = 0.0
    weight: complex = 0j
    drag: Array = field(default_factory=lambda: np.empty((0, 2)))
    contact: Contact | None = None
    place: float | None = None
    load: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rest: float = 0.0
    pull: complex = 0j

    @cached_property
    def panels(self) -> _Panels:
        """The stretches between ends, middles and ``place``, over which positions are sums."""
        return _Panels(self)

    def turns(self, angles: Array) -> Array:
        """Return by how much each arc turns [rad] (..., n) at ``angles`` (..., n)."""
        return np.diff(angles, axis=-1, prepend=self.base)

    def positions(self, angles: Array) -> ComplexArray:
        """Return the ends of the arcs [m] (..., n)."""
        return np.cumsum(self.panels.steps(angles).sum(axis=-1), axis=-1)[..., self.panels.ends]

    def velocities(self, angles: Array, rates: Array) -> ComplexArray:
        """Return the velocities of the ends of the arcs [m/s] (..., n)."""
        return self.marks(angles, rates)[1][..., self.panels.ends]

    def marks(self, angles: Array, rates: Array) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
        """Return positions, velocities and centripetal accelerations of the marks (..., P)."""
        p = self.panels
        steps, turning = p.steps(angles), p.mixed(rates, 0.0)
        sums = (steps, 1j * turning * steps, -(turning**2) * steps)
        z, v, a = (np.cumsum(part.sum(axis=-1), axis=-1) for part in sums)
        return z, v, a

    def forces(self, angles: Array, z: ComplexArray, v: ComplexArray) -> ComplexArray:
        """Return the forces [N] (..., P) on the marks but those of contact: weight, pull, load, drag."""
        p = self.panels
        force = np.broadcast_to(p.own * self.weight, z.shape).astype(complex)
        force[..., -1] += self.pull
        _, spring, dashpot = self.load
        if spring or dashpot:
            force[..., p.place] -= 1j * (spring * (z[..., p.place].imag - self.rest) + dashpot * v[..., p.place].imag)
        if len(self.drag):
            axis = np.exp(1j * (angles - 0.5 * self.turns(angles)))
            own = np.conj(axis) * v[..., p.middles]
            along, across = own.real, own.imag
            push = self.drag[:, 0] * np.abs(along) * along + 1j * self.drag[:, 1] * np.abs(across) * across
            force[..., p.middles] -= push * axis
        return force

    def touching(
        self, angles: Array, rates: Array, z: ComplexArray, v: ComplexArray
    ) -> list[tuple[complex, Array, Array, ComplexArray]]:
        """Return, for each face: its side i or -i, depth, loss factor and push (..., n) of the ends of arcs."""
        if self.contact is None:
            return []
        found, c = [], self.contact
        for side in (1j, -1j):
            arm = 0.5 * self.thickness * side * np.exp(1j * angles)
            depth = (np.conj(c.normal) * (c.point - z[..., self.panels.ends] - arm)).real
            rate = -(np.conj(c.normal) * (v[..., self.panels.ends] + 1j * rates * arm)).real
            factor = np.maximum(1 + c.damping * rate, 0.0)
            push = c.stiffness * np.maximum(depth, 0.0) * factor * c.normal
            found.append((side, depth, factor, push))
        return found

    def accelerations(self, angles: Array, rates: Array, bends: Array) -> Array:
        """Return the angular accelerations [rad/s^2] (n,) at free curvatures ``bends`` [1/m] (n,)."""
        z, v, centripetal = self.marks(angles, rates)
        J = self.panels.jacobian(angles)
        force = self.forces(angles, z, v) - self.panels.masses * centripetal
        load = self._contacts(angles, rates, z, v, force) + _work(J, force)
        inertia = _work(J, self.panels.masses[:, None] * J)
        return np.asarray(np.linalg.solve(inertia, load - _joints(self.moments(angles, rates, bends))))

    def moments(self, angles: Array, rates: Array, bends: Array) -> Array:
        """Return the moments [N m] (..., n) in the arcs."""
        bent = self.turns(angles) + self.loss * np.diff(rates, axis=-1, prepend=0.0)
        return self.stiffness * (bent / self.lengths - bends)

    def _contacts(self, angles: Array, rates: Array, z: ComplexArray, v: ComplexArray, force: ComplexArray) -> Array:
        """Add the plane's push to ``force`` (P,) in place, and return its moments about the arcs' ends (n,)."""
        moment = np.zeros(len(angles))
        for side, _, _, push in self.touching(angles, rates, z, v):
            force[self.panels.ends] += push
            moment += (np.conj(1j * 0.5 * self.thickness * side * np.exp(1j * angles)) * push).real
        return moment

    def slopes(self, angles: Array) -> tuple[Array, Array]:
        """Return the inertia (n, n), and the stiffness (n, n) of joints, weight, load and contact at rest."""
        p, J = self.panels, self.panels.jacobian(angles)
        z = np.cumsum(p.steps(angles).sum(axis=-1))
        still = np.zeros_like(angles)
        force = self.forces(angles, z, 0 * z)
        moments = np.zeros((len(angles), len(angles)))
        for side, depth, _, push in self.touching(angles, still, z, 0 * z):
            assert self.contact is not None
            force[p.ends] += push
            arm = 0.5 * self.thickness * side * np.exp(1j * angles)
            into = (np.conj(self.contact.normal) * (J[p.ends] + np.diag(1j * arm))).real
            moments += self.contact.stiffness * into.T @ ((depth > 0)[:, None] * into)
            moments += np.diag((np.conj(arm) * push).real)
        beyond = np.cumsum(force[::-1])[::-1]
        moments += p.weighted((np.conj(p.steps(angles)) * beyond[:, None]).real)
        if self.load[1]:
            rise = J[p.place].imag
            moments += self.load[1] * np.outer(rise, rise)
        return _work(J, p.masses[:, None] * J), moments + self.joints()

    def joints(self) -> Array:
        """Return the stiffness (n, n) of the joints [N m]."""
        bend = self.stiffness / self.lengths
        return np.diag(bend + np.append(bend[1:], 0.0)) - np.diag(bend[1:], 1) - np.diag(bend[1:], -1)

    def energies(self, angles: Array, rates: Array, bends: Array) -> Array:
        """Return kinetic, elastic (with contact and load), shear (zero) and gravitational energy [J] (..., 4)."""
        p, (z, v, _) = self.panels, self.marks(angles, rates)
        bent = self.stiffness * self.lengths * (self.turns(angles) / self.lengths - bends) ** 2
        elastic = 0.5 * bent.sum(axis=-1)
        if self.load[1]:
            elastic = elastic + 0.5 * self.load[1] * (z[..., p.place].imag - self.rest) ** 2
        for _, depth, _, _ in self.touching(angles, rates, z, v):
            assert self.contact is not None
            elastic = elastic + 0.5 * self.contact.stiffness * (np.maximum(depth, 0.0) ** 2).sum(axis=-1)
        kinetic = 0.5 * (p.masses * np.abs(v) ** 2).sum(axis=-1)
        height = (np.conj(self.weight) * p.own * z).real.sum(axis=-1) + (np.conj(self.pull) * z[..., -1]).real
        return np.stack([kinetic, elastic, np.zeros_like(kinetic), -height], axis=-1)

    def powers(self, angles: Array, rates: Array, bends: Array, bending: Array) -> Array:
        """Return the actuators' power and the losses in damping, drag, impact [W] (..., 4); ``bending`` is bends'."""
        p, (z, v, _) = self.panels, self.marks(angles, rates)
        elastic = self.stiffness * (self.turns(angles) / self.lengths - bends)
        actuator = -(elastic * self.lengths * bending).sum(axis=-1)
        turning = np.diff(rates, axis=-1, prepend=0.0)
        damped = (self.loss * self.stiffness / self.lengths * turning**2).sum(axis=-1)
        damped = damped + self.load[2] * v[..., p.place].imag ** 2
        drag, impact = np.zeros_like(damped), np.zeros_like(damped)
        if len(self.drag):
            own = np.conj(np.exp(1j * (angles - 0.5 * self.turns(angles)))) * v[..., p.middles]
            drag = (self.drag * np.abs(np.stack([own.real, own.imag], axis=-1)) ** 3).sum(axis=(-1, -2))
        for side, depth, factor, _ in self.touching(angles, rates, z, v):
            assert self.contact is not None
            arm = 0.5 * self.thickness * side * np.exp(1j * angles)
            out = (np.conj(self.contact.normal) * (v[..., p.ends] + 1j * rates * arm)).real
            lost = self.contact.stiffness * np.maximum(depth, 0.0) * (factor - 1) * out
            impact = impact - lost.sum(axis=-1)
        return np.stack([actuator, damped, drag, impact], axis=-1)

    @one_thread()
    def equilibrium(self, bends: Array, start: Array | None = None) -> Array:
        """Return the angles (n,) at rest under free curvatures ``bends`` [1/m] (n,), downhill of ``start``.

        Newton's method on the angles, damped until the energy falls. Raises SolveError where none is found.
        """
        angles = self.base + np.cumsum(bends * self.lengths) if start is None else start.copy()
        still, damping = np.zeros_like(angles), 1e-3
        joints = self.joints()
        angles = angles + 1e-9 * np.cumsum(self.lengths) / self.lengths.sum()
        energy = float(self.energies(angles, still, bends).sum())
        for _ in range(_STEPS):
            z = np.cumsum(self.panels.steps(angles).sum(axis=-1))
            force = self.forces(angles, z, 0 * z)
            load = self._contacts(angles, still, z, 0 * z, force) + _work(self.panels.jacobian(angles), force)
            rest = load - _joints(self.moments(angles, still, bends))
            stiff = self.slopes(angles)[1] + damping * joints
            try:
                np.linalg.cholesky(stiff)
                step = np.linalg.solve(stiff, rest)
            except np.linalg.LinAlgError:
                damping *= 4
                continue
            turn = float(np.abs(step).max())
            after = float(self.energies(angles + step, still, bends).sum()) if turn <= 2 * _TURN else np.inf
            if not after <= energy + 1e-13 * (abs(energy) + float(self.stiffness.sum() / self.lengths.sum())):
                damping *= 4
                continue
            angles, energy = angles + step, after
            if turn <= _SMALL and damping <= 1e-4:
                return angles
            damping = max(damping / 4, 1e-10)
        raise SolveError(f"no equilibrium of the chain was found in {_STEPS} steps; is a load too strong?")


class _Panels:
    """Stretches between the marks of a chain: Gauss points ``share`` (P, q) of an arc's way, ``weights`` (P, q) [m]."""

    def __init__(self, chain: Chain) -> None:
        ends = np.concatenate([[0.0], np.cumsum(chain.lengths)])
        length, n = float(ends[-1]), len(chain.lengths)
        marks = np.union1d(ends, (ends[1:] + ends[:-1]) / 2)
        place = length if chain.place is None else chain.place
        if np.abs(marks - place).min() > 1e-9 * length:
            marks = np.sort(np.append(marks, place))
        nodes, weights = leggauss(_POINTS)
        arc = cells_of(ends, (marks[1:] + marks[:-1]) / 2)
        size = np.diff(marks)[:, None]
        self.chain, self.arc, self.n = chain, arc, n
        self.share = (marks[:-1, None] + size * (nodes + 1) / 2 - ends[arc, None]) / chain.lengths[arc, None]
        self.weights = size * weights / 2
        near = marks[1:]  # the base carries nothing
        self.ends = np.abs(near[:, None] - ends[1:]).argmin(axis=0)
        self.middles = np.abs(near[:, None] - (ends[1:] + ends[:-1]) / 2).argmin(axis=0)
        self.place = int(np.abs(near - place).argmin())
        self.masses = np.zeros(len(near))
        own = chain.mass * chain.lengths
        self.masses[self.middles] += own * 4 / 6
        self.masses[self.ends] += own / 6
        self.masses[self.ends[:-1]] += own[1:] / 6
        self.own = self.masses.copy()  # without the load, whose weight is part of the pull
        self.masses[self.place] += chain.load[0]

    def mixed(self, angles: Array, base: float) -> Array:
        """Return what is linear along each arc (..., P, q), from ``base`` and the values at the arcs' ends (..., n)."""
        whole = np.concatenate([np.full((*angles.shape[:-1], 1), base), angles], axis=-1)
        return whole[..., self.arc, None] * (1 - self.share) + whole[..., self.arc + 1, None] * self.share

    def steps(self, angles: Array) -> ComplexArray:
        """Return the parts (..., P, q) of the way, whose sum is a position."""
        return np.asarray(self.weights * np.exp(1j * self.mixed(angles, self.chain.base)))

    def jacobian(self, angles: Array) -> ComplexArray:
        """Return the derivatives (P, n) of the marks' positions by the angles (n,)."""
        steps = 1j * self.steps(angles)
        local = np.zeros((len(self.arc), self.n + 1), dtype=complex)
        rows = np.arange(len(self.arc))
        local[rows, self.arc] = (steps * (1 - self.share)).sum(axis=1)
        local[rows, self.arc + 1] = (steps * self.share).sum(axis=1)
        return np.cumsum(local[:, 1:], axis=0)

    def weighted(self, values: Array) -> Array:
        """Return the sum (n, n) of ``values`` (P, q) times products of the angles' shares."""
        total = np.zeros((self.n + 1, self.n + 1))
        near = 1 - self.share
        np.add.at(total, (self.arc, self.arc), (values * near * near).sum(axis=1))
        np.add.at(total, (self.arc + 1, self.arc + 1), (values * self.share * self.share).sum(axis=1))
        both = (values * near * self.share).sum(axis=1)
        np.add.at(total, (self.arc, self.arc + 1), both)
        np.add.at(total, (self.arc + 1, self.arc), both)
        return total[1:, 1:]


def _work(J: ComplexArray, force: ComplexArray) -> Array:
    """Return the generalised forces: the real part of the conjugate transpose of ``J`` times ``force``."""
    return np.asarray(J.real.T @ force.real + J.imag.T @ force.imag)


def _joints(moments: Array) -> Array:
    """Return the moment of each joint less that of the next one (n,)."""
    return moments - np.append(moments[1:], 0.0)


def integrated(
    chain: Chain,
    samples: Array,
    bends: Callable[[float], Array],
    start: tuple[Array, Array],
    tolerance: float,
    *,
    stiff: bool = True,
    longest: float = np.inf,
    progress: Callable[[float], None] | None = None,
) -> tuple[Array, Array, Callable[[Array], tuple[Array, Array]], NDArray[np.float64]]:
    """Return angles and rates (t, n) at ``samples`` [s], both as functions of times, and the steps' times.

    ``bends`` gives the free curvatures [1/m] (n,) at a time; ``tolerance`` is the error of a step [rad], of rates times
    the chain's slowest angular frequency; no step is longer than ``longest`` [s]. ``stiff``: Radau's implicit method of
    order 5, else Dormand and Prince's explicit one of order 8 (both of scipy). Raises SolveError where no step is small
    enough.
    """
    from scipy.integrate import solve_ivp
    from scipy.linalg import eigh

    n, joints = len(chain.lengths), chain.joints()
    inertia, _ = chain.slopes(start[0])
    slowest = float(np.sqrt(eigh(joints, inertia, eigvals_only=True, subset_by_index=[0, 0])[0]))

    def rate(t: float, state: Array) -> Array:
        angles, rates = state[:n], state[n:]
        if progress is not None and t > 0.02 * samples[-1]:  # the first steps are short, and say nothing of the others
            progress(t)
        return np.concatenate([rates, chain.accelerations(angles, rates, bends(t))])

    def slope(_: float, state: Array) -> Array:
        mass, stiffness = chain.slopes(state[:n])
        found = np.zeros((2 * n, 2 * n))
        found[:n, n:] = np.eye(n)
        damping = chain.loss * joints
        if chain.load[2]:
            rise = chain.panels.jacobian(state[:n])[chain.panels.place].imag
            damping = damping + chain.load[2] * np.outer(rise, rise)
        found[n:] = -np.linalg.solve(mass, np.concatenate([stiffness, damping], axis=1))
        return found

    how = {"method": "Radau", "jac": slope} if stiff else {"method": "DOP853"}
    errors = tolerance * np.repeat([1.0, slowest], n)
    with one_thread():
        run = solve_ivp(
            rate, (0.0, float(samples[-1])), np.concatenate(start), dense_output=True, rtol=1e-10 + 0.1 * tolerance,
            atol=errors, max_step=longest, **how,
        )  # fmt: skip
    if not run.success:
        raise SolveError(f"no step is small enough for the chain at {run.t[-1]:.6g} s; is a load too strong?")

    def at(times: Array) -> tuple[Array, Array]:
        values = run.sol(times).T
        return values[..., :n], values[..., n:]

    return *at(samples), at, run.t
