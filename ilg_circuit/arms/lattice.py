"""The arm as a plane lattice of masses and springs: its description, its rest shape and its compiled form.

Rods 0 to n stand across the arm, rod 0 clamped; two edges join neighbouring rods, so that n quadrilateral cells lie in
a row. Side 0 is the face towards +normal (left of the axis when looking from base to tip), side 1 the other face.

Two formulations are a lattice: ``beam``, an elastic strip whose edges change their rest length (eigenstrain), and
``yekutieli``, pre-tensioned muscles whose stiffness follows the activation (Yekutieli et al., J. Neurophysiol. 94,
2005; the model of CPG §6.2, *Motion Simulation of Ionic Liquid Gel Soft Actuators Based on CPG Control*). The third,
``chain``, is the beam as arcs: see `chain`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ..arrays import Array
from ..errors import InputError, wrong_choice
from ..strip.actuator import CANTILEVER_EIGENVALUE, ORIENTATIONS, PAPER, Actuator
from ..strip.fields import quantity, validate_quantities
from .compiled import Indices

FORMULATIONS = ("beam", "chain", "yekutieli")
GRAVITY = 9.80665

#: Shear correction of a rectangular section, and G/E of an incompressible material.
SHEAR_CORRECTION, SHEAR_RATIO = 5 / 6, 1 / 3

#: Above this, the dense parts of the start-up and the files of a motion grow out of hand.
MOST_SEGMENTS = 5000


@dataclass(frozen=True)
class Muscle:
    """Muscles of the ``yekutieli`` formulation: f = z [(T_pas + T_act a)(l - r l0) + c0 l'], a in [0, 1].

    z is cross-section over relaxed length: b h/(2 l) along each face, b l/h across (half at the end rods). With these
    the pre-tension is the same in both directions, and the constant area of the cells holds it in balance.
    """

    passive: float = quantity("Pa", "passive stiffness T_pas", default=2.0e3)
    active: float = quantity("Pa", "active stiffness T_act at full activation", zero=True, default=1.32e5)
    damping: float = quantity("Pa s", "damping c0", zero=True, default=9.0)
    rest_ratio: float = quantity("", "rest length over initial length, r; sources differ, 0.5 to 0.8", default=0.5)

    def __post_init__(self) -> None:
        validate_quantities(self)
        if not self.rest_ratio < 1:
            raise InputError(
                f"muscle.rest_ratio is {self.rest_ratio:g}; it must be below 1 (without pre-tension activation makes "
                "no force)"
            )


@dataclass(frozen=True)
class Fluid:
    """A fluid around the arm: buoyancy, and drag -1/2 rho c S |v| v across and along each segment.

    S is length x depth across, and the segment's whole wetted surface 2 l (h + b) along (assumed).
    """

    density: float = quantity("kg/m^3", "density of the fluid", default=1022.0)
    drag_across: float = quantity("", "drag coefficient across the arm", zero=True, default=1.013)
    drag_along: float = quantity("", "drag coefficient along the arm", zero=True, default=0.0256)

    def __post_init__(self) -> None:
        validate_quantities(self)


@dataclass(frozen=True)
class Plane:
    """A frictionless half-space that pushes back: f = k d (1 + chi d') along its normal, d the depth of a node.

    ``point`` [m] lies on its surface, ``normal`` points out of it.
    """

    point: tuple[float, float]
    normal: tuple[float, float]
    stiffness: float = quantity("N/m", "stiffness k for each node")
    damping: float = quantity("s/m", "loss chi of an impact", zero=True, default=1.0)

    def __post_init__(self) -> None:
        validate_quantities(self)
        object.__setattr__(self, "point", _vector("plane.point", self.point))
        normal = _vector("plane.normal", self.normal)
        size = math.hypot(*normal)
        if size == 0:
            raise InputError("plane.normal is zero; give a direction that points out of the plane")
        if abs(size - 1) > 1e-15:
            normal = (normal[0] / size, normal[1] / size)
        object.__setattr__(self, "normal", normal)


@dataclass(frozen=True)
class Arm:
    """A soft arm, clamped at its base. Sizes in the plane: ``length``, ``thickness``; out of it: ``depth``.

    ``tip_thickness`` and ``tip_depth`` give a linear taper. ``damping`` is the loss time c/k [s] of the beam's springs
    and of its shear (Kelvin-Voigt: a mode of angular frequency w is damped by w damping/2). ``direction`` [rad] is the
    axis at the base, ``gravity`` [m/s^2] a vector, ``curvature`` [1/m] of the rest shape, one value or one a
    segment, positive towards +normal. ``stabilisation`` [1/s] is beta, with which errors of a cell's area die away.
    """

    length: float = quantity("m", "length from clamp to tip")
    thickness: float = quantity("m", "thickness in the plane, at the base")
    depth: float = quantity("m", "depth out of the plane, at the base")
    density: float = quantity("kg/m^3", "density")
    youngs_modulus: float = quantity("Pa", "Young's modulus of the beam formulation", default=7600.0)
    damping: float = quantity("s", "loss time c/k of the beam formulation", zero=True, default=0.0)
    tip_thickness: float | None = quantity("m", "thickness at the tip; as at the base if absent", default=None)
    tip_depth: float | None = quantity("m", "depth at the tip; as at the base if absent", default=None)
    segments: int = 15
    formulation: str = "beam"
    muscle: Muscle = Muscle()
    gravity: tuple[float, float] = (0.0, 0.0)
    direction: float = 0.0
    curvature: float | tuple[float, ...] = 0.0
    fluid: Fluid | None = None
    plane: Plane | None = None
    stabilisation: float = quantity("1/s", "rate beta at which errors of the area die away", default=500.0)

    def __post_init__(self) -> None:
        validate_quantities(self)
        if isinstance(self.segments, bool) or not isinstance(self.segments, (int, np.integer)):
            raise InputError(f"arm.segments is {str(self.segments)[:40]!r}; give a whole number")
        if not 1 <= self.segments <= MOST_SEGMENTS:
            raise InputError(f"arm.segments is {self.segments}; give 1 to {MOST_SEGMENTS}")
        object.__setattr__(self, "segments", int(self.segments))
        if self.formulation not in FORMULATIONS:
            raise wrong_choice("arm.formulation", self.formulation, FORMULATIONS)
        object.__setattr__(self, "gravity", _vector("arm.gravity", self.gravity))
        if not _finite(self.direction):
            raise InputError(f"arm.direction is {self.direction}; give a finite angle in rad")
        bends = self.curvature if isinstance(self.curvature, tuple) else (self.curvature,) * self.segments
        if len(bends) != self.segments:
            raise InputError(f"arm.curvature has {len(bends)} values for {self.segments} segments; give one for each")
        for k, bend in enumerate(bends, 1):
            if not _finite(bend):
                raise InputError(f"arm.curvature of segment {k} is {bend}; give a finite value in 1/m")
            if abs(bend) * max(self.thickness, self.tip_thickness or 0.0) >= 1:
                raise InputError(f"arm.curvature of segment {k} is {bend:g} 1/m: the inner face would fold over")

    @property
    def strained(self) -> bool:
        """True if an activation is a strain of the faces, of a beam or a chain; False if it is a muscle's."""
        return self.formulation != "yekutieli"

    @property
    def segment_length(self) -> float:
        """l [m]: along the rest shape's axis."""
        return self.length / self.segments

    def tapered(self, at_cells: bool) -> tuple[Array, Array]:
        """Return the thickness h and depth b [m], at the cells' middles (n,) or at the rods (n + 1,)."""
        n = self.segments
        x = (np.arange(n) + 0.5) / n if at_cells else np.arange(n + 1) / n
        tips = (self.tip_thickness or self.thickness, self.tip_depth or self.depth)
        return (self.thickness + (tips[0] - self.thickness) * x, self.depth + (tips[1] - self.depth) * x)

    def rest_positions(self) -> Array:
        """Return the nodes of the rest shape [m] (n + 1, 2, 2): rod, side, axis; the axis' base is the origin."""
        turn = np.broadcast_to(self.curvature, self.segments) * self.segment_length
        heading = self.direction + np.concatenate([[0.0], np.cumsum(turn)])
        chord = self.segment_length * np.sinc(turn / (2 * np.pi))
        steps = chord[:, None] * _unit((heading[1:] + heading[:-1]) / 2)
        centre = np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])
        across = 0.5 * self.tapered(at_cells=False)[0][:, None] * _unit(heading + np.pi / 2)
        return np.stack([centre + across, centre - across], axis=1)

    @property
    def first_frequency(self) -> float:
        """First angular frequency of the untapered beam, Euler-Bernoulli [rad/s]: 1.8751^2 sqrt(E I/(rho A))/L^2."""
        slenderness = self.youngs_modulus * self.thickness**2 / (12 * self.density)
        return float((CANTILEVER_EIGENVALUE / self.length) ** 2 * math.sqrt(slenderness))


class Model(NamedTuple):
    """An `Arm` as the kernels need it; n cells, n + 1 rods.

    A spring's tension is (k + k_active a)(l - l0 (1 + strain a)) + c l'. The 3 n + 1 springs are the edges, by cell and
    side, then the rods; ``spring`` (3 n + 1, 7): rod and column of x of its two nodes, the two cells whose mean
    activation is its own (of an edge twice the same), and their channel. Shear energy 1/2 K (cos - cos0)^2 of E
    elements, cos between a direction r across the arm and a tangent t, which are sums over three rods: of x(side 0) -
    x(side 1), and of x(side 0) + x(side 1), ``shear_index`` and weights (E, 3). Muscles have none.
    """

    mass: Array  # (n + 1,) of each of a rod's two nodes [kg]
    mobility: Array  # its inverse, zero at the clamp [1/kg]
    weight: tuple[float, float]  # acceleration of gravity less buoyancy [m/s^2]
    strain: float  # 1: activation is an eigenstrain; 0: it is a stiffness
    spring: Indices
    spring_length: Array
    spring_stiffness: Array
    spring_active: Array
    spring_damping: Array
    shear_index: Indices
    shear_across: Array
    shear_along: Array
    shear_cosine: Array
    shear_stiffness: Array
    shear_damping: Array
    area: Array  # (n,) [m^2]
    beta: float
    drag: Array  # (n, 2) 1/2 rho c S along and across [kg/m]; empty without a fluid
    plane: tuple[float, float, float, float, float, float]  # point, normal, stiffness, damping; zeros without one


def model(arm: Arm) -> Model:
    """Return the compiled form of ``arm``: stiffnesses of physics as the `Arm` and `Muscle` docstrings state them.

    ``beam``: k_edge = E b h/(6 l) makes E I exact, k_rod = (2/3) E b l/h (half at the end rods) E A under constant
    area; a shear energy 1/2 kappa G A l cos^2 removes the lattice's n mechanisms. Half of it is counted in the cells
    (mean of the two rods against the axis between them), half at the rods (rod against the second-order tangent:
    central inside, three-point at the ends with half the length). Neither locks, and each alone has a blind spot: the
    first does not see rods that tilt by turns, so that a coarse lattice buckles under tension, the second does not
    see a saw-tooth of the axis, so that a fine one buckles under compression.
    """
    n, length = arm.segments, arm.segment_length
    q = arm.rest_positions()
    ends = np.ones(n + 1)
    ends[[0, -1]] = 0.5
    (h_cell, b_cell), (h, b) = arm.tapered(at_cells=True), arm.tapered(at_cells=False)
    edge_length = np.linalg.norm(np.diff(q, axis=0), axis=2)
    sections = np.concatenate([((b_cell * h_cell / 2)[:, None] / edge_length).ravel(), ends * b * length / h])
    index, across, along, lengths = _shear_elements(n)
    if arm.formulation == "beam":
        e = arm.youngs_modulus
        stiffness = e * sections * np.repeat([1 / 3, 2 / 3], [2 * n, n + 1])
        active, damping = 0.0 * stiffness, arm.damping * stiffness
        areas = np.concatenate([b_cell * h_cell, b * h])[: len(lengths)]
        shear = SHEAR_CORRECTION * SHEAR_RATIO * e * areas * lengths * length
        ratio, strain = 1.0, 1.0
    else:
        muscle = arm.muscle
        stiffness, active, damping = (z * sections for z in (muscle.passive, muscle.active, muscle.damping))
        index, across, along, shear = index[:0], across[:0], along[:0], lengths[:0]
        ratio, strain = muscle.rest_ratio, 0.0
    area = cell_areas(q)
    quarter = arm.density * area * b_cell / 4
    mass = np.pad(quarter, (0, 1)) + np.pad(quarter, (1, 0))
    mobility = 1 / mass
    mobility[0] = 0.0
    fluid = arm.fluid
    lift, drag = 1.0, np.empty((0, 2))
    if fluid is not None:
        lift = 1 - fluid.density / arm.density
        along_axis = fluid.density / 2 * fluid.drag_along * 2 * length * (h_cell + b_cell)
        drag = np.stack([along_axis, fluid.density / 2 * fluid.drag_across * length * b_cell], axis=1)
    spring_length = ratio * np.concatenate([edge_length.ravel(), np.linalg.norm(q[:, 0] - q[:, 1], axis=1)])
    springs = (_springs(n), spring_length, stiffness, active, damping)
    shears = (index, across, along, _cosines(q, index, across, along), shear, arm.damping * shear)
    weight = (lift * arm.gravity[0], lift * arm.gravity[1])
    wall = arm.plane
    plane = (*wall.point, *wall.normal, wall.stiffness, wall.damping) if wall else (0.0,) * 6
    parts = (mass, mobility, weight, strain, *springs, *shears, area, arm.stabilisation, drag, plane)
    return Model(*parts)


def cell_areas(positions: Array) -> Array:
    """Return the cells' areas [m^2] (..., n) for nodes (..., n + 1, 2, 2): half the cross product of diagonals."""
    one = positions[..., 1:, 0, :] - positions[..., :-1, 1, :]
    two = positions[..., :-1, 0, :] - positions[..., 1:, 1, :]
    return np.asarray(0.5 * (one[..., 0] * two[..., 1] - one[..., 1] * two[..., 0]))


def strip_arm(actuator: Actuator = PAPER, *, segments: int = 15, mounting: str | None = None) -> Arm:
    """Return the free part of a strip as an arm in the ``beam`` formulation.

    Length L0, thickness b, depth w, E and density are the strip's; the loss time is the one that damps the first mode
    by the strip's beam damping ratio. ``mounting`` (default: the strip's) is weightless, hanging or horizontal.
    """
    g, m = actuator.geometry, actuator.material
    mounting = mounting or actuator.mounting.orientation
    if mounting not in ORIENTATIONS:
        raise wrong_choice("mounting", mounting, ORIENTATIONS)
    arm = Arm(
        length=g.free_length,
        thickness=g.thickness,
        depth=g.width,
        density=m.density,
        youngs_modulus=m.youngs_modulus,
        segments=segments,
    )
    return mounted(replace(arm, damping=2 * m.beam_damping_ratio / arm.first_frequency), mounting)


def mounted(arm: Arm, mounting: str) -> Arm:
    """Return ``arm`` weightless, hanging or horizontal."""
    gravity = (0.0, 0.0 if mounting == "weightless" else -GRAVITY)
    return replace(arm, gravity=gravity, direction=-math.pi / 2 if mounting == "hanging" else 0.0)


def _springs(n: int) -> Indices:
    """Return the nodes, cells and channel of all springs, as in `Model`."""
    edges = [(i, 2 * side, i + 1, 2 * side, i, i, side) for i in range(n) for side in range(2)]
    rods = [(j, 2, j, 0, max(j - 1, 0), min(j, n - 1), 2) for j in range(n + 1)]
    return np.array([*edges, *rods], dtype=np.int64)


def _shear_elements(n: int) -> tuple[Indices, Array, Array, Array]:
    """Return shear elements of n cells, then n + 1 rods: rods (E, 3), weights in r and t (E, 3), lengths (E,).

    r is a sum of rods, t one of rods' centres, as the weights say; a length counts segments.
    """
    cells = np.arange(n)[:, None] + np.array([0, 1, 1])
    ones = np.ones((n, 1))
    elements = [(cells, ones * [0.5, 0.5, 0.0], ones * [-1.0, 1.0, 0.0], np.full(n, 1.0))]
    if n > 1:
        inside = np.clip(np.arange(n + 1), 1, n - 1)[:, None] + np.array([-1, 0, 1])
        across, along = np.zeros((n + 1, 3)), np.zeros((n + 1, 3))
        across[1:-1, 1], across[0, 0], across[-1, 2] = 1.0, 1.0, 1.0
        along[1:-1], along[0], along[-1] = [-0.5, 0.0, 0.5], [-1.5, 2.0, -0.5], [0.5, -2.0, 1.5]
        lengths = np.ones(n + 1)
        lengths[[0, -1]] = 0.5
        elements = [(cells, *elements[0][1:3], np.full(n, 0.5)), (inside, across, along, 0.5 * lengths)]
    index, across, along, lengths = (np.concatenate(parts) for parts in zip(*elements, strict=True))
    return index, across, 0.5 * along, lengths  # a centre is half the sum of two nodes


def _cosines(q: Array, index: Indices, across: Array, along: Array) -> Array:
    """Return the cosine between the two directions of each shear element (E,)."""
    r = (across[:, :, None] * (q[:, 0] - q[:, 1])[index]).sum(axis=1)
    t = (along[:, :, None] * (q[:, 0] + q[:, 1])[index]).sum(axis=1)
    return np.asarray((r * t).sum(axis=1) / np.linalg.norm(r, axis=1) / np.linalg.norm(t, axis=1))


def _unit(angle: Array) -> Array:
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def _finite(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)


def _vector(name: str, value: object) -> tuple[float, float]:
    numbers = tuple(value) if isinstance(value, (tuple, list, np.ndarray)) else ()
    if len(numbers) != 2 or not all(_finite(float(x)) for x in numbers):
        raise InputError(f"{name} is {str(value)[:40]}; give two finite numbers")
    return float(numbers[0]), float(numbers[1])


#: An octopus arm in sea water, hanging in the plane, after Yekutieli et al. 2005 (sizes and coefficients).
OCTOPUS = Arm(
    length=0.24,
    thickness=15e-3,
    depth=15e-3,
    tip_thickness=1e-3,
    tip_depth=1e-3,
    density=1042.0,
    formulation="yekutieli",
    gravity=(0.0, -GRAVITY),
    fluid=Fluid(),
)
