"""Motions of an `Arm` in the ``chain`` formulation, in the form that those of the lattice have; shapes of strips by it.

A chain has no faces: nodes are drawn at half the thickness across the centre line, tensions along the faces are those
of a section with the chain's moment and axial force, and there are neither pressures nor tensions across.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.polynomial.legendre import leggauss

from ..arrays import Array, ComplexArray
from ..circuit.load import Load
from ..errors import InputError
from ..simulation.curvature import Curvatures
from ..simulation.elastica import acting
from ..simulation.response import Response
from ..simulation.shape import POINTS, Shape, along, arcs, curved, described
from ..strip.elements import bending_stiffness
from .activation import Activation, corners, resampled
from .chain import Chain, Contact, integrated
from .lattice import Arm, strip_arm
from .motion import Motion

#: Arcs in the free part of a strip: at least, at most, and for each length over which weight straightens it.
_LEAST, _MOST, _IN_LAYER = 40, 160, 8.0
#: Steps that the corners of an activation may ask for.
_MOST_STEPS = 5000
#: Gauss points between steps, for the integrals of powers.
_POINTS = 4


def chain_of(arm: Arm) -> Chain:
    """Return the chain of an ``arm``, as stiff and heavy as its lattice; the plane pushes on the ends of arcs."""
    n = arm.segments
    (h, b), ends = arm.tapered(at_cells=True), arm.tapered(at_cells=False)[0]
    lengths = np.full(n, arm.segment_length)
    lift, drag = 1.0, np.empty((0, 2))
    if (fluid := arm.fluid) is not None:
        lift = 1 - fluid.density / arm.density
        wetted = 2 * lengths * (h + b)
        parts = [fluid.drag_along * wetted, fluid.drag_across * lengths * b]
        drag = fluid.density / 2 * np.stack(parts, axis=1)
    wall = arm.plane
    contact = None
    if wall is not None:
        contact = Contact(complex(*wall.point), complex(*wall.normal), wall.stiffness, wall.damping)
    return Chain(
        lengths=lengths,
        stiffness=arm.youngs_modulus * b * h**3 / 12,
        mass=arm.density * b * h,
        thickness=ends[1:],
        base=arm.direction,
        loss=arm.damping,
        weight=lift * complex(*arm.gravity),
        drag=drag,
        contact=contact,
    )


def bends_of(arm: Arm, activations: Array) -> Array:
    """Return the free curvatures [1/m] (..., n) of strains (..., n, 3) in the `CHANNELS`, with that of the rest shape.

    Raises InputError for strains that would change the length or the thickness of a chain.
    """
    one, two, across = np.moveaxis(activations, -1, 0)
    if np.abs(one + two).max(initial=0.0) > 1e-12 or across.any():
        raise InputError("a chain keeps its length: give strains of its two faces that are opposite, and none across")
    return np.asarray((two - one) / arm.tapered(at_cells=True)[0] + np.broadcast_to(arm.curvature, arm.segments))


def at_rest(arm: Arm, drive: Activation, at: float, start: Array | None) -> tuple[Array, Array]:
    """Return positions (n + 1, 2, 2) and pressures (n,), zero, of a chain at rest, as `statics.equilibrium`."""
    chain = chain_of(arm)
    angles = chain.equilibrium(bends_of(arm, drive.at([at])[0]), None if start is None else _angles(arm, start))
    return _nodes(arm, chain.positions(angles), angles), np.zeros(arm.segments)


def chain_frequencies(arm: Arm, count: int, drive: Activation | None) -> Array:
    """Return the lowest angular frequencies [rad/s] of a chain, as `statics.natural_frequencies`."""
    from scipy.linalg import eigh

    n, chain = arm.segments, chain_of(arm)
    if not 1 <= count <= n:
        raise InputError(f"{count} frequencies: a chain of {n} segments has 1 to {n}")
    if drive is None:
        chain, values = replace(chain, weight=0j), np.zeros((n, 3))
    else:
        values = drive.at([0.0])[0]
    inertia, stiffness = chain.slopes(chain.equilibrium(bends_of(arm, values)))
    squares = eigh(stiffness, inertia, eigvals_only=True)
    return np.asarray(np.sqrt(np.maximum(squares[:count], 0.0)))


def move_chain(
    arm: Arm,
    drive: Activation,
    samples: Array,
    *,
    explicit: bool = False,
    tolerance: float,
    start: tuple[Array, Array] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Motion:
    """Return the motion at ``samples`` [s] of an arm in the formulation ``chain``, as `dynamics.simulate`."""
    chain, n = chain_of(arm), arm.segments
    waves = bends_of(arm, drive.values)
    begin = (arm.direction + np.cumsum(np.broadcast_to(arm.curvature, n) * chain.lengths), np.zeros(n))
    if start is not None:
        begin = (_angles(arm, start[0]), _rates(start))
    told = None if progress is None else lambda t: progress(round(1000 * t / samples[-1]), 1000)
    bends = _between(drive.time, waves)
    longest = _longest(corners(drive, tolerance), samples[-1])
    angles, rates, at, steps = integrated(
        chain, samples, bends, begin, tolerance, stiff=not explicit, longest=longest, progress=told
    )
    values, now = drive.at(samples), resampled(samples, drive.time, waves)
    tension = _tensions(chain, angles, rates, now)
    return Motion(
        arm=arm,
        time=samples,
        positions=_nodes(arm, chain.positions(angles), angles),
        velocities=_swept(arm, chain.velocities(angles, rates), angles, rates),
        activations=values,
        pressures=np.zeros((len(samples), n)),
        edge_forces=tension,
        rod_forces=np.zeros((len(samples), n + 1)),
        energies=chain.energies(angles, rates, now),
        works=_works(chain, samples, drive.time, waves, at, steps),
        method="explicit" if explicit else "implicit",
        text=drive.text,
    )


def moving_shape(response: Response, points: int = POINTS, tolerance: float = 1e-6) -> Shape:
    """Return the shape of a strip over time with its inertia, damping, weight and load: a chain fed cell by cell.

    It begins at rest. Raises InputError for a strip without a coupling or whose first time is not 0, SolveError where
    the motion cannot be computed.
    """
    free, actuator = curved(response), response.actuator
    if response.time[0] != 0 or len(response.time) < 2:
        raise InputError("mechanics arm follows the strip from t = 0: give two times or more, the first of them 0")
    on, load = acting(actuator, response.load, response.tip), response.load or Load()
    stiffness, g = bending_stiffness(actuator), actuator.geometry
    length, mass = float(free.ends[-1]), actuator.material.density * g.width * g.thickness
    tension = abs(complex(*on.weight)) * length + abs(complex(*on.force))
    parts = int(np.clip(_IN_LAYER * length * np.sqrt(tension / stiffness), _LEAST, _MOST))
    ends = along(free, parts + 1)
    cells = Curvatures(free.time, np.diff(ends), free.values[:, np.searchsorted(free.ends, ends[1:] * (1 - 1e-9)) - 1])
    ones = np.ones(len(cells.lengths))
    chain = Chain(
        lengths=cells.lengths,
        stiffness=stiffness * ones,
        mass=mass * ones,
        thickness=g.thickness * ones,
        loss=strip_arm(actuator).damping,
        place=g.load_distance,
    )
    held = replace(chain, weight=complex(*on.weight) / mass, pull=complex(*on.force))
    if on.spring and (on.weight[1] or on.force[1]):
        sagged = held.equilibrium(0 * ones)
        held = replace(held, rest=float(np.cumsum(held.panels.steps(sagged).sum(axis=1)).imag[held.panels.place]))
    held = replace(held, load=(load.mass, on.spring, load.damping))
    longest = _longest(response.time, response.time[-1])
    begin = held.equilibrium(cells.values[0]), 0 * ones
    angles = integrated(held, response.time, _between(free.time, cells.values), begin, tolerance, longest=longest)[0]
    bent = Curvatures(free.time, cells.lengths, held.turns(angles) / cells.lengths)
    places = along(free, points, np.array([g.load_distance]))
    return Shape(response.time, places, *arcs(bent, places), described(response), "arm")


def _between(times: Array, values: Array) -> Callable[[float], Array]:
    """Return a function of time [s] that is linear between ``values`` (t, n) at ``times``, and constant beyond them."""

    def at(t: float) -> Array:
        k = int(np.clip(np.searchsorted(times, t) - 1, 0, max(len(times) - 2, 0)))
        if len(times) == 1 or t <= times[0]:
            return np.asarray(values[0])
        part = min((t - times[k]) / (times[k + 1] - times[k]), 1.0)
        return np.asarray(values[k] + part * (values[k + 1] - values[k]))

    return at


def _longest(corners: Array, duration: float) -> float:
    """Return the longest step [s] that passes over no corner without a look at it."""
    inside = np.unique(corners[corners < duration])
    gaps = np.diff(np.append(inside, duration))
    return float(max(gaps.min(initial=duration), duration / _MOST_STEPS))


def _works(
    chain: Chain, samples: Array, times: Array, waves: Array, at: Callable[[Array], tuple[Array, Array]], steps: Array
) -> Array:
    """Return the integrals of the powers since t = 0 at ``samples`` (t, 4)."""
    inside = times[(times > 0) & (times < samples[-1])]
    marks = np.unique(np.concatenate([[0.0], samples, steps[steps <= samples[-1]], inside]))
    nodes, weights = leggauss(_POINTS)
    size = np.diff(marks)[:, None]
    places = (marks[:-1, None] + size * (nodes + 1) / 2).ravel()
    slopes = np.diff(waves, axis=0) / np.diff(times)[:, None] if len(times) > 1 else np.zeros((1, waves.shape[1]))
    k = np.clip(np.searchsorted(times, places) - 1, 0, len(slopes) - 1)
    moving = ((places > times[0]) & (places < times[-1]))[:, None] * slopes[k]
    power = chain.powers(*at(places), resampled(places, times, waves), moving)
    done = (power.reshape(-1, _POINTS, 4) * (size * weights / 2)[..., None]).sum(axis=1)
    return np.pad(np.cumsum(done, axis=0), ((1, 0), (0, 0)))[np.searchsorted(marks, samples)]


def _tensions(chain: Chain, angles: Array, rates: Array, bends: Array) -> Array:
    """Return the tensions [N] (t, n, 2) along the faces: half the axial force less and plus moment over thickness."""
    p, found = chain.panels, np.empty((*angles.shape, 2))
    for k, (angle, rate, bend) in enumerate(zip(angles, rates, bends, strict=True)):
        z, v, centripetal = chain.marks(angle, rate)
        moved = p.jacobian(angle) @ chain.accelerations(angle, rate, bend) + centripetal
        force = chain.forces(angle, z, v) - p.masses * moved
        for _, _, _, push in chain.touching(angle, rate, z, v):
            force[p.ends] += push
        beyond = np.cumsum(force[::-1])[::-1][p.middles]  # the middle's own mass counted with what is beyond
        axis = np.exp(1j * (angle - 0.5 * chain.turns(angle)))
        axial = (np.conj(axis) * (beyond - 0.5 * force[p.middles])).real
        moment = chain.moments(angle, rate, bend) / chain.thickness
        found[k] = np.stack([axial / 2 - moment, axial / 2 + moment], axis=-1)
    return found


def _nodes(arm: Arm, ends: ComplexArray, angles: Array) -> Array:
    """Return the nodes (..., n + 1, 2, 2) of ends of arcs (..., n) and angles (..., n)."""
    first = np.zeros((*ends.shape[:-1], 1))
    centre = np.concatenate([first + 0j, ends], axis=-1)
    heading = np.concatenate([first + arm.direction, angles], axis=-1)
    across = 0.5 * arm.tapered(at_cells=False)[0] * 1j * np.exp(1j * heading)
    return _pairs(np.asarray(centre, np.complex128), np.asarray(across, np.complex128))


def _swept(arm: Arm, velocities: ComplexArray, angles: Array, rates: Array) -> Array:
    """Return the velocities of the nodes (t, n + 1, 2, 2)."""
    centre = np.pad(velocities, ((0, 0), (1, 0)))
    turning = np.pad(-rates * np.exp(1j * angles), ((0, 0), (1, 0)))
    across = 0.5 * arm.tapered(at_cells=False)[0] * turning
    return _pairs(np.asarray(centre, np.complex128), np.asarray(across, np.complex128))


def _pairs(centre: ComplexArray, across: ComplexArray) -> Array:
    sides = np.stack([centre + across, centre - across], axis=-1)
    return np.stack([sides.real, sides.imag], axis=-1)


def _angles(arm: Arm, positions: Array) -> Array:
    """Return the angles (n,) of the rods of ``positions`` (n + 1, 2, 2), less than half a turn from one to the next."""
    across = np.asarray(positions, dtype=np.float64)
    if across.shape != (arm.segments + 1, 2, 2) or not np.isfinite(across).all():
        raise InputError(f"start: give finite positions of the shape {(arm.segments + 1, 2, 2)}")
    rods = across[:, 0] - across[:, 1]
    heading = np.append(arm.direction, np.arctan2(rods[1:, 1], rods[1:, 0]) - np.pi / 2)
    return np.unwrap(heading)[1:]


def _rates(start: tuple[Array, Array]) -> Array:
    """Return the angular velocities (n,) of the rods."""
    rods, moving = (part[1:, 0] - part[1:, 1] for part in start)
    return np.asarray((rods[:, 0] * moving[:, 1] - rods[:, 1] * moving[:, 0]) / (rods**2).sum(axis=1))
