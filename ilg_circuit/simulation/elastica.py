"""The elastica: the static shape, of any deflection, of a strip that weight and load bend against its free curvature.

    EI (theta' - kappa0) = M,    M' = n_x sin theta - n_y cos theta,    M(L) = 0

kappa0 is the free curvature, n(s) the force on the strip beyond s. These are the conditions for a minimum of

    1/2 integral of M^2/EI ds - integral of n . (cos theta, sin theta) ds + 1/2 k (y_F - y_0)^2

with the spring k of a load at y_F. theta beyond the free angle is a polynomial on each of the elements into which the
strip is divided (Ritz); elements end where kappa0 or n jumps, and are halved until the last coefficients are small.
Newton's method with the exact second derivative solves for many instants at once, each from the last one that was found
before them, so that a strip with several equilibria stays at the one that it came from until that vanishes.

Axes: x along the strip at the clamp, y towards the anode.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial.legendre import leggauss, legvander

from ..arrays import Array, Mask, one_thread
from ..circuit.load import Load
from ..errors import SolveError
from ..strip.actuator import Actuator
from ..strip.elements import GRAVITY, bending_stiffness
from .curvature import Curvatures, cells_of

#: Degree of an element, and Gauss points there and between two places of the shape.
_DEGREE, _POINTS = 7, 10
#: An element is halved where its last coefficients turn the strip by more than this [rad]; most elements.
_TURN, _MOST_ELEMENTS = 1e-9, 1000
#: Newton's method has converged where a step turns no part by more than this [rad], and is on another branch, perhaps,
#: where one turns a part by more than that.
_CONVERGED, _FAR = 1e-10, 0.3
#: Most instants at once.
_AT_ONCE = 64
#: Instants from which the elements are chosen.
_TRIED = 9
#: Angle at the free end [rad] by which a search begins beside its start.
_NUDGE = 1e-6
#: Stiffness of the spring, times EI/L_F^3, that holds a clamped tip.
_HELD = 1e8


@dataclass(frozen=True)
class Acting:
    """What acts on a strip: ``weight`` per length [N/m] (2,), ``force`` [N] (2,) at its free end, ``spring`` [N/m].

    The spring acts at ``place`` [m], along y, against the distance from where that is at rest without a free curvature.
    """

    weight: tuple[float, float] = (0.0, 0.0)
    force: tuple[float, float] = (0.0, 0.0)
    spring: float = 0.0
    place: float = 0.0

    def __bool__(self) -> bool:
        return bool(any(self.weight) or any(self.force) or self.spring)


def acting(actuator: Actuator, load: Load | None = None, tip: str = "free") -> Acting:
    """Return what acts on a strip by its mounting, a ``load`` at L_F and a ``tip`` that is free or clamped.

    The weight of a load acts at the free end, as in the circuit; a weightless strip's load has none.
    """
    g, load = actuator.geometry, load or Load()
    down = {"hanging": (1.0, 0.0), "horizontal": (0.0, -1.0)}.get(actuator.mounting.orientation, (0.0, 0.0))
    per_length = actuator.material.density * g.width * g.thickness * GRAVITY
    held = _HELD * bending_stiffness(actuator) / g.load_distance**3 if tip == "clamped" else 0.0
    return Acting(
        weight=(per_length * down[0], per_length * down[1]),
        force=(load.mass * GRAVITY * down[0], load.mass * GRAVITY * down[1]),
        spring=load.stiffness + held,
        place=g.load_distance,
    )


@one_thread()
def elastica(free: Curvatures, stiffness: float, on: Acting, places: Array) -> tuple[Array, Array, Array]:
    """Return x, y [m] and the angle [rad], each (n, m), at ``places`` [m] (m,) along a strip.

    ``free`` are its free curvatures, ``stiffness`` EI [N m^2], ``on`` what acts on it. Raises SolveError where no
    equilibrium is found.
    """
    length = float(free.ends[-1])
    bent = Curvatures(free.time, free.lengths / length, free.values * length)
    unit = stiffness / length**2
    scaled = Acting(
        (on.weight[0] * length / unit, on.weight[1] * length / unit),
        (on.force[0] / unit, on.force[1] / unit),
        on.spring * length / unit,
        min(on.place / length, 1.0),
    )
    where = np.minimum(places / length, 1.0)
    at_rest = 0.0
    if on.spring and (on.weight[1] or on.force[1]):
        still = Curvatures(np.zeros(1), np.ones(1), np.zeros((1, 1)))
        at_rest = float(_solved(still, scaled, np.array([scaled.place]), 0.0, springs=False)[1][0, 0])
    x, y, angle = _solved(bent, scaled, where, at_rest)
    return length * x, length * y, angle


def _solved(
    bent: Curvatures, on: Acting, places: Array, at_rest: float, *, springs: bool = True
) -> tuple[Array, Array, Array]:
    """Return x, y and angle as `elastica`, all lengths over the strip's, forces over EI/L^2."""
    if not springs:
        on = Acting(on.weight, on.force, 0.0, on.place)
    borders = np.union1d(bent.ends, [on.place])
    borders = borders[np.append(np.diff(borders) > 1e-12, True)]
    edges = np.unique(np.concatenate([np.linspace(a, b, int(np.ceil(4 * (b - a))) + 1) for a, b in _pairs(borders)]))
    tried = np.unique(np.linspace(0, len(bent.time) - 1, _TRIED).astype(int))
    some = Curvatures(bent.time[tried], bent.lengths, bent.values[tried])
    for part in (some, bent):
        while True:
            elements = _Elements(edges, on, at_rest)
            found = elements.followed(part.angles(elements.places.ravel()).reshape(-1, *elements.places.shape))
            rough = elements.rough(found)
            if not rough.any():
                break
            if len(edges) + rough.sum() > _MOST_ELEMENTS:
                raise SolveError("the strip is too soft for its weight and load: its shape has a corner at the clamp")
            edges = np.union1d(edges, (edges[1:] + edges[:-1])[rough] / 2)
    return elements.shape(bent, found, places)


class _Elements:
    """The elements between ``edges`` (E + 1,), with the energy of the whole strip and its derivatives.

    The unknowns (E, p) are, by element, the angle beyond the free one at its far end and the coefficients of the
    polynomials that vanish at both of its ends: integrals of Legendre's, which makes the bending energy diagonal in
    these. ``places`` (E, q) are the Gauss points. The second derivative couples neighbours only, but for the spring's
    part, which has rank one.
    """

    def __init__(self, edges: Array, on: Acting, at_rest: float) -> None:
        nodes, weights = leggauss(_POINTS)
        size = np.diff(edges)[:, None]
        self.edges, self.spring, self.at_rest = edges, on.spring, at_rest
        self.places = edges[:-1, None] + size * (nodes + 1) / 2
        self.basis = _basis((nodes + 1) / 2)
        bending = np.diag([1.0, 1.0, *(1 / (2 * np.arange(1, _DEGREE) + 1))])
        bending[0, 1] = bending[1, 0] = -1.0
        self.bending = bending / size[:, :, None]
        inside = self.places < on.place
        beyond = (1 - self.places)[..., None] * np.array(on.weight) + np.array(on.force)
        self.force = (size * weights / 2)[..., None] * beyond
        self.to_place = size * weights / 2 * inside

    def followed(self, free: Array) -> Array:
        """Return the unknowns (n, E, p) at free angles (n, E, q), each instant from those found before."""
        found = np.zeros((len(free), len(self.edges) - 1, _DEGREE))
        start, done, many = found[0], 0, _AT_ONCE
        while done < len(free):
            now = slice(done, min(done + many, len(free)))
            solved = self._newton(start, free[now])
            if solved is None and now.stop - done > 1:
                many = max((now.stop - done) // 4, 1)
                continue
            found[now] = self._settled(start, free[now]) if solved is None else solved
            start, done = found[now.stop - 1], now.stop
            many = min(2 * many, _AT_ONCE)
        return found

    def rough(self, found: Array) -> Mask:
        """Return which elements (E,) have last coefficients that are not small."""
        return np.asarray(np.abs(found[:, :, -2:]).max(axis=(0, 2)) / (2 * _DEGREE) > _TURN)

    def beyond_free(self, found: Array, places: Array) -> Array:
        """Return the angles (n, m) beyond the free ones at ``places`` (m,)."""
        element = cells_of(self.edges, places)
        part = (places - self.edges[element]) / np.diff(self.edges)[element]
        return np.asarray((_local(found)[:, element] * _basis(part)).sum(axis=2))

    def shape(self, bent: Curvatures, found: Array, places: Array) -> tuple[Array, Array, Array]:
        """Return x, y, angle (n, m) at ``places`` (m,)."""
        marks = np.union1d(self.edges, places)
        nodes, weights = leggauss(_POINTS)
        size = np.diff(marks)[:, None]
        between = (marks[:-1, None] + size * (nodes + 1) / 2).ravel()
        angle = bent.angles(between) + self.beyond_free(found, between)
        at = np.searchsorted(marks, places)
        path = []
        for part in (np.cos(angle), np.sin(angle)):
            steps = (part.reshape(len(found), -1, _POINTS) * (size * weights / 2)).sum(axis=2)
            path.append(np.pad(np.cumsum(steps, axis=1), ((0, 0), (1, 0)))[:, at])
        return path[0], path[1], bent.angles(places) + self.beyond_free(found, places)

    def _derivatives(self, unknowns: Array, free: Array) -> tuple[Array, Array, Array]:
        """Return the energy (n,), its first element and those of the spring's end, and the second ones.

        First derivatives (n, E, p + 1, 2) and second ones (n, E, p + 1, p + 1) are by the element's own unknowns, the
        angle at its near end before those of `_Elements`; the latter without the spring's part of rank one.
        """
        own = _local(unknowns)
        angle = free + own @ self.basis.T
        cos, sin = np.cos(angle), np.sin(angle)
        along = cos * self.force[..., 0] + sin * self.force[..., 1]
        across = cos * self.force[..., 1] - sin * self.force[..., 0]
        bent = (self.bending @ own[..., None])[..., 0]
        away = (sin * self.to_place).sum(axis=(1, 2)) - self.at_rest
        pull = self.spring * away[:, None, None] * self.to_place
        energy = (own * bent).sum(axis=(1, 2)) / 2 - along.sum(axis=(1, 2)) + self.spring * away**2 / 2
        first = np.stack([bent - (across - pull * cos) @ self.basis, (cos * self.to_place) @ self.basis], axis=-1)
        return energy, first, self.bending + self.basis.T @ ((along - pull * sin)[..., None] * self.basis)

    def _step(self, first: Array, second: Array) -> tuple[Array, bool]:
        """Return Newton's step (n, E, p), and whether all second derivatives are positive: the equilibria stable."""
        inner = np.linalg.solve(second[..., 2:, 2:], np.concatenate([second[..., 2:, :2], first[..., 2:, :]], axis=-1))
        of_ends, of_first = inner[..., :2], inner[..., 2:]
        outer = second[..., :2, 2:]
        pairs, loads = second[..., :2, :2] - outer @ of_ends, first[..., :2, :] - outer @ of_first
        diagonal, right = pairs[:, :, 1, 1].copy(), loads[:, :, 1].copy()
        diagonal[:, :-1] += pairs[:, 1:, 0, 0]
        right[:, :-1] += loads[:, 1:, 0]
        beside = pairs[:, 1:, 0, 1]
        count = diagonal.shape[1]
        for e in range(1, count):
            ratio = beside[:, e - 1] / diagonal[:, e - 1]
            diagonal[:, e] -= ratio * beside[:, e - 1]
            right[:, e] -= ratio[:, None] * right[:, e - 1]
        right[:, -1] /= diagonal[:, -1, None]
        for e in range(count - 2, -1, -1):
            right[:, e] = (right[:, e] - beside[:, e, None] * right[:, e + 1]) / diagonal[:, e, None]
        ends = np.stack([np.pad(right[:, :-1], ((0, 0), (1, 0), (0, 0))), right], axis=2)
        steps = np.concatenate([right[:, :, None], of_first - of_ends @ ends], axis=2)
        negative = (diagonal < 0).sum(axis=1)
        step = steps[..., 0]
        if self.spring:  # Sherman and Morrison; the spring can take away one negative direction
            rate = _own(first[..., 1])
            ratio = 1 + self.spring * (rate * steps[..., 1]).sum(axis=(1, 2))
            step = step - steps[..., 1] * (self.spring * (rate * step).sum(axis=(1, 2)) / ratio)[:, None, None]
            negative = np.where(ratio < 0, negative - 1, negative)
        return step, bool((negative == 0).all()) and _positive(second[..., 2:, 2:])

    def _newton(self, start: Array, free: Array) -> Array | None:
        """Return the unknowns (n, E, p) of stable equilibria by full steps; None where these go far or astray."""
        unknowns = np.repeat(start[None], len(free), axis=0)
        for _ in range(12):
            _, first, second = self._derivatives(unknowns, free)
            step, stable = self._step(first, second)
            turn = self._turn(step)
            if not (stable and turn <= _FAR):
                return None
            unknowns -= step
            if turn <= _CONVERGED:
                return unknowns
        return None

    def _settled(self, start: Array, free: Array) -> Array:
        """Return the unknowns (1, E, p) of the minimum that lies downhill of ``start``, by damped steps."""
        unknowns, damping = start[None].copy(), 1e-3
        unknowns[:, :, 0] += _NUDGE * self.edges[1:]  # off an equilibrium that is not stable, such as a straight strut
        energy, first, second = self._derivatives(unknowns, free)
        for _ in range(2000):
            step, stable = self._step(first, second + damping * self.bending)
            turn = self._turn(step)
            tried = unknowns - step
            after = self._derivatives(tried, free) if stable and turn <= 2 * _FAR else None
            if after is None or not after[0][0] <= energy[0] + 1e-13 * (1 + abs(energy[0])):
                damping *= 4
                continue
            unknowns, (energy, first, second) = tried, after
            if turn <= _CONVERGED and damping <= 1e-4:
                return unknowns
            damping = max(damping / 4, 1e-9)
        raise SolveError("no equilibrium of the strip under its weight and load was found; is the load too large?")

    def _turn(self, step: Array) -> float:
        return float(np.abs(_local(step) @ self.basis.T).max())


def _basis(part: Array) -> Array:
    """Return the functions of an element (m, p + 1) at ``part`` (m,) of its way: of its ends, then those within."""
    values = legvander(2 * part - 1, _DEGREE)
    within = [(values[:, j + 1] - values[:, j - 1]) / (2 * (2 * j + 1)) for j in range(1, _DEGREE)]
    return np.stack([1 - part, part, *within], axis=1)


def _local(unknowns: Array) -> Array:
    """Return each element's own unknowns (n, E, p + 1), its near end's before `_Elements`' (n, E, p)."""
    near = np.pad(unknowns[:, :-1, :1], ((0, 0), (1, 0), (0, 0)))
    return np.concatenate([near, unknowns], axis=2)


def _own(local: Array) -> Array:
    """Return derivatives by the unknowns (n, E, p) from those by each element's own (n, E, p + 1)."""
    total = local[:, :, 1:].copy()
    total[:, :-1, 0] += local[:, 1:, 0]
    return total


def _positive(matrices: Array) -> bool:
    try:
        np.linalg.cholesky(matrices)
    except np.linalg.LinAlgError:
        return False
    return True


def _pairs(borders: Array) -> list[tuple[float, float]]:
    return list(zip(borders[:-1].tolist(), borders[1:].tolist(), strict=True))
