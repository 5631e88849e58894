"""Search for a rhythm that brings the arm's tip to a target, and the places that tips visit; CPG §6.

The paper claims that the arm, driven by its pattern generator, can reach any specified position. Here that is tried:
a seeded search over the generator's parameters for the motion whose tip passes nearest to the target, and the set of
places that tips visit over a seeded sample of the parameters. The voltage that gives an output of A_ref is the largest
one, A_ref the free amplitude of the network at its default parameters: so the tonic input scales the strains.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array
from ..errors import InputError, SolveError, wrong_choice
from ..findings import Finding, sentences
from ..oscillators.flow import Flow, sampled
from ..oscillators.network import Network, default_start, wired
from ..oscillators.rhythm import rhythm
from ..strip.actuator import PAPER, Actuator
from ..units import require_positive
from .activation import activation
from .circuits import through_circuits
from .coupling import (
    LARGEST_VOLTAGE,
    Coupled,
    couple,
    driving,
    lagging,
    lumped_strain,
    segment_strip,
    unit_of_segment,
)
from .dynamics import Progress, simulate
from .lattice import Arm
from .motion import Motion

RHYTHMS = ("unit", "ring", "one-way-ring", "chain")
#: Where each parameter is looked for: the tonic input e, the inhibition a within the window of a cycle (by the paper's
#: constants 1.4 to 4; a one-way ring begins at 2.17), the stretching of the time constants, ks = kc of a chain.
BOUNDS = {"tonic": (0.1, 2.0), "inhibition": (1.5, 3.9), "slower": (0.5, 100.0), "connection": (0.02, 0.3)}
_ONE_WAY_INHIBITION = (2.25, 3.9)
#: Distance in arm lengths within which a tip has reached the target.
TOLERANCE = 0.01
#: Share of the disc of the arm's length from which on any position counts as reachable.
EVERYWHERE = 0.99
#: Motions of the sample, and of each local search from the best of them.
SAMPLE = 64
_STARTS, _LOCAL = 3, 30
#: While searching: samples of the rhythm and of the motion in a period, and the error of a step.
_SIGNAL, _PATH, _STEP_ERROR = 100, 40, 1e-3
_PATHS = (100, 800)
#: Distance in arm lengths that stands for a motion that could not be computed.
_FAR = 10.0
#: Squares, along a side of the rectangle about all visited places, that are counted at most.
_SQUARES = 800


@dataclass(frozen=True)
class Reached:
    """The motion of ``arm`` whose tip passes nearest to ``target`` [m] (2,), and the places that tips visit.

    ``parameters`` of the network, within ``bounds``; the tip is ``distance`` [m] from the target at ``time`` [s] of
    ``motion``, at ``nearest`` [m] (2,). ``visited`` [m] (points, 2): tips of the ``sample`` (k, parameters) of motions.
    ``failed``: how many motions of the search could not be computed.
    """

    target: Array
    tolerance: float
    parameters: dict[str, float]
    bounds: dict[str, tuple[float, float]]
    time: float
    nearest: Array
    distance: float
    coupled: Coupled
    motion: Motion
    sample: Array
    visited: Array
    failed: int

    @property
    def reached(self) -> bool:
        """True if the tip comes within the tolerance."""
        return self.distance <= self.tolerance

    @cached_property
    def share(self) -> float:
        """Part of the disc of the arm's length about its base that lies within the tolerance of a visited place."""
        from scipy.spatial import cKDTree

        length = self.motion.arm.length
        low, high = self.visited.min(axis=0) - self.tolerance, self.visited.max(axis=0) + self.tolerance
        side = max(self.tolerance / 20, float((high - low).max()) / _SQUARES)
        x, y = np.meshgrid(*(np.arange(a + side / 2, b, side) for a, b in zip(low, high, strict=True)))
        inside = np.hypot(x, y) <= length
        places = np.stack([x[inside], y[inside]], axis=1)
        away, _ = cKDTree(self.visited).query(places, distance_upper_bound=self.tolerance)
        return float(np.isfinite(away).sum() * side**2 / (np.pi * length**2))

    @property
    def everywhere(self) -> bool:
        """True if the paper's claim, that any position can be reached, holds for this sample."""
        return self.share > EVERYWHERE

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Reasons why not every position can be reached."""
        arm, coupled = self.motion.arm, self.coupled
        findings = []
        away = float(np.hypot(*self.target))
        if away > arm.length:
            findings.append(Finding("reach-too-far", values={"away": away, "length": arm.length}))
        one = len(coupled.run.network.units) == 1
        findings.append(Finding("reach-one-unit" if one else "reach-one-rhythm"))
        if arm.strained:
            turn = 2 * coupled.largest_strain * arm.length / arm.thickness
            arc = np.hypot(np.sinc(turn / np.pi) - 1, turn / 2 * np.sinc(turn / 2 / np.pi) ** 2)  # tip, from straight
            moved = float(arm.length * arc)
            values = {"strain": coupled.largest_strain, "turn": float(np.degrees(turn)), "moved": moved}
            findings.append(Finding("reach-bounded-strain", values=values))
        if coupled.mode != "ideal" and coupled.scales:
            scale = coupled.scales[0]
            findings.append(Finding("reach-circuit", values={"kept": scale.kept, "period": scale.period}))
        return tuple(findings)

    @property
    def reasons(self) -> tuple[str, ...]:
        """The findings as sentences."""
        return sentences(self.findings)


def reach_target(
    arm: Arm,
    target: ArrayLike,
    duration: float,
    *,
    rhythm_of: str = "unit",
    mode: str = "ideal",
    actuator: Actuator = PAPER,
    voltage: float = LARGEST_VOLTAGE,
    times: ArrayLike | None = None,
    tolerance: float | None = None,
    start: tuple[Array, Array] | None = None,
    sample: int | None = None,
    seed: int = 0,
    progress: Progress | None = None,
) -> Reached:
    """Look for the parameters of a network with which the tip comes nearest to ``target`` [m] (x, y) in ``duration``.

    ``rhythm_of`` is one of `RHYTHMS`; parameters lie within `BOUNDS`, and a period within the duration. A Latin
    hypercube of ``sample`` motions (default: `SAMPLE`), then Nelder and Mead's search from the best of them; the best
    motion is computed again at ``times`` [s] (default: 601) to full accuracy. ``tolerance`` [m]: within it the target
    is reached (default: `TOLERANCE` of the arm's length). ``start`` as in `simulate`. Also in ``ideal`` mode the
    voltage is bounded, and with it the strain. Raises InputError for values out of range.
    """
    wanted = _checked(target)
    within = arm.length * TOLERANCE if tolerance is None else tolerance
    require_positive("tolerance", within, "m")
    require_positive("duration", duration, "s")
    sample = SAMPLE if sample is None else sample
    if sample < 2:
        raise InputError(f"a sample of {sample} motions is too small; give 2 or more")
    if seed < 0:
        raise InputError(f"seed {seed} must be zero or more")
    search = _Search(arm, rhythm_of, mode, actuator, voltage, duration, start)
    rng = np.random.default_rng(seed)
    points = _hypercube(rng, sample, len(search.bounds))
    total = sample + _STARTS * _LOCAL

    def distance(point: Array) -> tuple[float, Array]:
        tips = search.tips(point)
        if progress:
            progress(min(search.done, total), total)
        return (_passing(tips, wanted)[0] if len(tips) else _FAR * arm.length), tips

    found = [distance(point) for point in points]
    if not any(len(tips) for _, tips in found):
        raise SolveError(f"none of {sample} motions could be computed; is the activation or a load too strong?")
    best = _refined(lambda p: distance(p)[0], points, np.array([d for d, _ in found]), 0.1 * within)
    parameters = search.parameters(best)
    coupled, motion = search.in_full(parameters, np.linspace(0, duration, 601) if times is None else times)
    away, at, share = _passing(motion.tip, wanted)
    samples = np.arange(len(motion.time))
    time, *nearest = (float(np.interp(at + share, samples, wave)) for wave in (motion.time, *motion.tip.T))
    if progress:
        progress(total, total)
    return Reached(
        target=wanted,
        tolerance=within,
        parameters=parameters,
        bounds=search.bounds,
        time=time,
        nearest=np.array(nearest),
        distance=away,
        coupled=coupled,
        motion=motion,
        sample=np.array([list(search.parameters(point).values()) for point in points]),
        visited=np.concatenate([tips for _, tips in found if len(tips)]),
        failed=search.failed,
    )


def rhythm_network(name: str, segments: int, **constants: Any) -> Network:
    """Return the network of one of `RHYTHMS` for an arm of ``segments``; ``constants`` of `wired`, None by default."""
    if name not in RHYTHMS:
        raise wrong_choice("rhythm", name, RHYTHMS)
    known = {key: value for key, value in constants.items() if value is not None}
    if name == "chain":
        known["neurons"] = 2 * segments
    return wired(topology="mutual" if name == "unit" else name, **known)


class _Search:
    """Path of the tip as a function of a point in the unit cube of parameters."""

    def __init__(
        self, arm: Arm, rhythm_of: str, mode: str, actuator: Actuator, voltage: float, duration: float, start: Any
    ) -> None:
        self.arm, self.rhythm_of, self.mode = arm, rhythm_of, mode
        self.voltage, self.duration, self.start = voltage, duration, start
        self.length = arm.segment_length if arm.strained else None
        self.done = self.failed = 0
        ordinary = rhythm(self.network({}))
        self.reference, self.period = ordinary.amplitude, float(ordinary.period or duration)
        self.bounds = {n: b for n, b in BOUNDS.items() if n != "connection" or rhythm_of == "chain"}
        if rhythm_of == "one-way-ring":
            self.bounds["inhibition"] = _ONE_WAY_INHIBITION
        low, high = BOUNDS["slower"]
        self.bounds["slower"] = (low, float(np.clip(duration / self.period, 2 * low, high)))
        self.couple = partial(couple, mode=mode, actuator=actuator, voltage=voltage)
        self.couple(self.network({}), 1, 1e-3 * self.period)  # so that errors in these are raised before the search
        self.strip = segment_strip(actuator, arm.segments, self.length)
        self.largest = lumped_strain(actuator, voltage)

    def parameters(self, point: Array) -> dict[str, float]:
        """Return the parameters at a point; the time scale is spread evenly in its logarithm, others linearly."""
        values = {}
        for share, (name, (low, high)) in zip(np.clip(point, 0, 1).tolist(), self.bounds.items(), strict=True):
            values[name] = low * (high / low) ** share if name == "slower" else low + share * (high - low)
        return values

    def network(self, values: dict[str, float]) -> Network:
        """Return the network of the parameters, its time constants not yet stretched."""
        known = {name: values.get(name) for name in ("tonic", "inhibition")}
        k = values.get("connection")
        return rhythm_network(self.rhythm_of, self.arm.segments, **known, same=k, cross=k)

    def tips(self, point: Array) -> Array:
        """Return the tip's path [m] (t, 2) with the parameters at ``point``; empty where it could not be computed."""
        self.done += 1
        values = self.parameters(point)
        network = self.network(values).slowed(values["slower"])
        periods = self.duration / (values["slower"] * self.period)
        signal = np.linspace(0.0, self.duration, int(np.ceil(_SIGNAL * periods)) + 101)
        path = np.linspace(0.0, self.duration, int(np.clip(_PATH * periods, *_PATHS)))
        states = sampled(Flow(network), default_start(network), signal)
        outputs = np.maximum(states[:, : network.size], 0.0) @ network.readout.T
        shares = np.clip(outputs / self.reference, -1.0, 1.0)
        try:
            strains = self.largest * shares
            if self.mode != "ideal":  # a strip for each unit: all segments of a unit are equal
                charges, strains, _ = through_circuits(self.strip, signal, self.voltage * shares)
            if self.mode == "charge":
                strains = lagging(self.strip, charges, self.voltage, self.largest)
            strains = strains[:, unit_of_segment(len(network.units), self.arm.segments)]
            drive = activation(self.arm, signal, driving(self.arm, strains, self.largest))
            return simulate(self.arm, drive, path, start=self.start, tolerance=_STEP_ERROR).tip
        except SolveError:
            self.failed += 1
            return np.empty((0, 2))

    def in_full(self, values: dict[str, float], times: ArrayLike) -> tuple[Coupled, Motion]:
        """Return the motion with the parameters, to full accuracy."""
        network, segments, slower = self.network(values), self.arm.segments, values["slower"]
        coupled = self.couple(
            network, segments, self.duration, segment_length=self.length, slower=slower, reference=self.reference
        )
        if self.mode == "ideal":
            coupled = replace(coupled, strains=coupled.largest_strain * coupled.voltages / self.voltage)
        motion = simulate(self.arm, coupled.activation(self.arm), times, start=self.start)
        return coupled, replace(motion, signals=coupled.signals(motion.time))


def _checked(target: ArrayLike) -> Array:
    try:
        place = np.asarray(target, dtype=np.float64)
    except (TypeError, ValueError):
        place = np.empty(0)
    if place.shape != (2,) or not np.isfinite(place).all():
        raise InputError(f"target {str(target)[:40]}: give two finite numbers, x and y in metres")
    return place


def _hypercube(rng: np.random.Generator, count: int, dimensions: int) -> Array:
    """Return a Latin hypercube (count, dimensions): every coordinate once in each of ``count`` equal parts."""
    parts = np.stack([rng.permutation(count) for _ in range(dimensions)], axis=1)
    return np.asarray((parts + rng.random((count, dimensions))) / count)


def _refined(distance: Callable[[Array], float], points: Array, distances: Array, enough: float) -> Array:
    """Return the best point of Nelder-Mead searches from the best ``points``; none once ``enough`` [m] is reached."""
    from scipy.optimize import minimize

    order = np.argsort(distances, kind="stable")
    best, least = points[order[0]], float(distances[order[0]])
    for k in order[:_STARTS]:
        if least <= enough:
            break
        found = minimize(
            distance,
            points[k],
            method="Nelder-Mead",
            bounds=[(0.0, 1.0)] * points.shape[1],
            options={"maxfev": _LOCAL, "initial_simplex": _simplex(points[k]), "fatol": enough, "xatol": 1e-3},
        )
        if found.fun < least:
            best, least = np.asarray(found.x), float(found.fun)
    return np.asarray(best)


def _simplex(point: Array) -> Array:
    """Return the point, and along each axis one a tenth away, towards the middle of the cube."""
    corners = np.repeat(point[None], len(point) + 1, axis=0)
    corners[np.arange(1, len(point) + 1), np.arange(len(point))] += np.where(point < 0.5, 0.1, -0.1)
    return np.asarray(corners)


def _passing(tips: Array, target: Array) -> tuple[float, int, float]:
    """Return how near [m] the path through ``tips`` (t, 2) passes ``target``, in which interval, and where in it."""
    if len(tips) == 1:
        return float(np.hypot(*(tips[0] - target))), 0, 0.0
    along = np.diff(tips, axis=0)
    square = (along**2).sum(axis=1)
    share: Array = ((target - tips[:-1]) * along).sum(axis=1) / np.where(square > 0, square, 1.0)
    share = np.clip(share, 0.0, 1.0)
    away = np.hypot(*(tips[:-1] + share[:, None] * along - target).T)
    at = int(away.argmin())
    return float(away[at]), at, float(share[at])
