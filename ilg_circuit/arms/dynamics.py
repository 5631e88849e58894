"""The arm's motion over time: choice of method, integration to given times, events."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array
from ..errors import InputError, SolveError, wrong_choice
from ..findings import Finding
from .activation import Activation, corners
from .chain_motion import move_chain
from .energy import crosses_itself
from .explicit import DONE, NOT_FINITE, RUNNING, Integration, explicit
from .forces import acceleration
from .implicit import implicit
from .lattice import Arm, Model, model
from .motion import Event, Motion, motion

METHODS = ("auto", "explicit", "implicit")

#: Error of a step, relative to the smaller of thickness and segment length; of velocities, times `velocity_rate`.
TOLERANCE = 1e-6

#: Times that a caller may pass to follow the work: done, of how much.
Progress = Callable[[int, int], None]

#: The explicit method is stable for steps up to these over the fastest oscillation and the fastest decay.
_STABLE_OSCILLATION, _STABLE_DECAY = 1.0, 3.3
#: Work of an implicit step over that of an explicit one, measured for 15 to 100 segments.
_IMPLICIT_WORK = 6.0


@dataclass(frozen=True)
class Stiffness:
    """Fastest rates of an arm at rest [1/s]: ``oscillation`` (angular frequency) and ``decay`` (of a damped mode)."""

    oscillation: float
    decay: float

    @property
    def explicit_steps(self) -> float:
        """Steps that the explicit method needs for a second, to be stable."""
        return max(self.oscillation / _STABLE_OSCILLATION, self.decay / _STABLE_DECAY)


def velocity_rate(arm: Arm) -> float:
    """Return the transits of a wave per second, sqrt(modulus/density)/length [1/s]: turns lengths into velocities."""
    modulus = arm.youngs_modulus if arm.strained else arm.muscle.passive + arm.muscle.active
    return math.sqrt(modulus / arm.density) / arm.length


def stiffness(arm: Arm, drive: Activation) -> Stiffness:
    """Return the fastest rates by power iteration at the rest shape, at the highest activation of each segment."""
    m, q = model(arm), arm.rest_positions().reshape(-1, 4)
    a = np.zeros((arm.segments, 3)) if arm.strained else drive.values.max(axis=0)
    return Stiffness(math.sqrt(_fastest(m, q, a, by_velocity=False)), _fastest(m, q, a, by_velocity=True))


def _fastest(m: Model, q: Array, a: Array, *, by_velocity: bool) -> float:
    n = len(m.area)
    p, work, zero = np.zeros(n), np.zeros((n, 6)), np.zeros_like(q)
    rest, moved = np.zeros_like(q), np.zeros_like(q)
    acceleration(m, q, zero, a, p, rest, work)
    probe = np.random.default_rng(1).standard_normal(q.shape)
    largest = 0.0
    for _ in range(60):
        probe[0] = 0.0
        size = float(np.linalg.norm(probe))
        if not math.isfinite(size):
            break
        probe *= 1e-6 * math.sqrt(m.area[0]) / size
        acceleration(m, q if by_velocity else q + probe, probe if by_velocity else zero, a, p, moved, work)
        change = moved - rest
        largest = float(np.linalg.norm(change) / np.linalg.norm(probe))
        probe = change
    return largest


def choose(arm: Arm, drive: Activation, duration: float, tolerance: float = TOLERANCE) -> tuple[str, str]:
    """Return the method with less work for a motion, and why, from the stiffness and the time scales to resolve."""
    rates = stiffness(arm, drive)
    times = corners(drive, tolerance)
    knots = int(((times > 0) & (times < duration)).sum()) / duration
    # what the implicit method has to resolve: the activation's corners, and modes that oscillate before they are damped
    # (Kelvin-Voigt: those below oscillation^2/decay, which is 1/damping in the beam formulation)
    ringing = min(rates.oscillation, rates.oscillation**2 / max(rates.decay, 1e-300))
    implicit_steps = max(2 * knots, ringing)
    name = "implicit" if rates.explicit_steps > _IMPLICIT_WORK * implicit_steps else "explicit"
    reason = (
        f"fastest oscillation {rates.oscillation:.3g} 1/s, fastest decay {rates.decay:.3g} 1/s: the explicit method "
        f"would need {rates.explicit_steps:.3g} steps a second, the implicit one some {implicit_steps:.3g}, each "
        f"{_IMPLICIT_WORK:g} times the work"
    )
    return name, reason


def simulate(
    arm: Arm,
    drive: Activation,
    times: ArrayLike,
    *,
    method: str = "auto",
    tolerance: float = TOLERANCE,
    start: tuple[Array, Array] | None = None,
    progress: Progress | None = None,
) -> Motion:
    """Return the arm's motion under ``drive`` from t = 0, sampled at ``times`` [s] (t,), ascending and >= 0.

    ``start`` holds positions and velocities (n + 1, 2, 2) instead of the rest shape at rest. ``tolerance`` bounds the
    error of each step, see `TOLERANCE`; steps end at every sample and at the activation's `corners`. A ``chain`` is
    followed by scipy's Radau (implicit, also for auto) or DOP853, whose steps are no longer than the time between
    corners. Raises InputError for values out of range, SolveError at the first value that is not finite or where no
    step is small enough, naming segment and time.
    """
    samples = np.asarray(times, dtype=np.float64)
    if samples.ndim != 1 or len(samples) == 0 or not np.isfinite(samples).all():
        raise InputError("times: give finite sample times in one dimension")
    if samples[0] < 0 or (np.diff(samples) <= 0).any() or samples[-1] == 0:
        raise InputError("times: sample times must be ascending, from zero on")
    if method not in METHODS:
        raise wrong_choice("method", method, METHODS)
    if not 1e-12 <= tolerance <= 1e-2:
        raise InputError(f"tolerance is {tolerance:g}; give 1e-12 to 1e-2")
    if drive.values.shape[1] != arm.segments:
        raise InputError(f"the activation is for {drive.values.shape[1]} segments, the arm has {arm.segments}")
    duration = float(samples[-1])
    if arm.formulation == "chain":
        how: dict[str, Any] = {"tolerance": tolerance, "start": start, "progress": progress}
        return move_chain(arm, drive, samples, explicit=method == "explicit", **how)
    name, reason = (method, "asked for") if method != "auto" else choose(arm, drive, duration, tolerance)
    m = model(arm)
    run = _prepare(arm, drive, samples, tolerance, start)
    kernel = explicit if name == "explicit" else implicit
    while run.counts[4] == RUNNING:
        kernel(m, run)
        if progress is not None:
            progress(round(1000 * run.clock[0] / duration), 1000)
    _, steps, refused, _, status = run.counts.tolist()
    if status != DONE:
        raise _failure(run)
    *_, shortest, longest = run.clock.tolist()
    taken = {"steps": steps, "shortest": shortest, "longest": longest, "refused": refused}
    events = [
        Event(0.0, Finding("arm-method", values={"method": name, "reason": reason})),
        Event(0.0, Finding("arm-step-error", values={"tolerance": tolerance, "scale": run.tolerance[0] / tolerance})),
        Event(duration, Finding("arm-steps", values=taken)),
    ]
    return motion(arm, drive, samples, run, name, _watch(arm, samples, run) + events)


def _prepare(
    arm: Arm, drive: Activation, samples: Array, tolerance: float, start: tuple[Array, Array] | None
) -> Integration:
    n, count = arm.segments, len(samples)
    duration = float(samples[-1])
    knots = corners(drive, tolerance)
    knots = knots[(knots > 0) & (knots < duration)]
    # a corner closer to a sample than rounding can tell apart is that sample
    near = np.minimum(np.searchsorted(samples, knots), count - 1)
    gap = np.minimum(np.abs(samples[near] - knots), np.abs(samples[np.maximum(near - 1, 0)] - knots))
    stops = np.union1d(np.concatenate([[0.0], samples]), knots[gap > 1e-12 * duration])
    sample = np.full(len(stops), -1, dtype=np.int64)
    sample[np.searchsorted(stops, samples)] = np.arange(count)
    q, v = arm.rest_positions(), np.zeros((n + 1, 2, 2))
    if start is not None:
        q, v = (np.array(x, dtype=np.float64) for x in start)
        if q.shape != (n + 1, 2, 2) or v.shape != q.shape or not (np.isfinite(q).all() and np.isfinite(v).all()):
            raise InputError(f"start: give finite positions and velocities of the shape {(n + 1, 2, 2)}")
        v[0] = 0.0
    scale = tolerance * min(float(arm.tapered(at_cells=False)[0].min()), arm.segment_length)
    first = min(1e-3 / velocity_rate(arm), duration)
    return Integration(
        stops=stops,
        times=drive.time,
        values=drive.values,
        sample=sample,
        states=np.repeat(np.stack([q, v]).reshape(1, 2, n + 1, 4), 3, axis=0),
        clock=np.array([0.0, first, 0.0, 0.0, 0.0, 0.0, np.inf, 0.0]),
        counts=np.zeros(5, dtype=np.int64),
        samples=np.empty((count, 2, n + 1, 4)),
        pressures=np.empty((count, n)),
        works=np.empty((count, 4)),
        tolerance=(scale, scale * velocity_rate(arm)),
    )


def _failure(run: Integration) -> SolveError:
    where = f"segment {max(int(run.counts[3]), 1)} at {run.clock[0]:.6g} s"
    not_finite = run.counts[4] == NOT_FINITE
    what = "the arm's motion is not finite any more" if not_finite else "no step is small enough for the arm"
    return SolveError(f"{what} in {where}; is the activation or a load too strong?")


def _watch(arm: Arm, samples: Array, run: Integration) -> list[Event]:
    """Return the events visible in the samples: the outline crosses itself, the plane is touched."""
    events = []
    for time, q in zip(samples, run.samples[:, 0], strict=True):
        segment = int(crosses_itself(q))
        if segment:
            events.append(Event(float(time), Finding("arm-crosses-itself", values={"segment": segment}), warning=True))
            break
    if arm.plane is not None:
        normal = np.array(arm.plane.normal)
        depth = (np.array(arm.plane.point) - run.samples[:, 0].reshape(len(samples), -1, 2, 2)) @ normal
        touched = np.argwhere(depth > 0)
        if len(touched):
            at, rod, _ = touched[0].tolist()
            events.append(Event(float(samples[at]), Finding("arm-touches-plane", values={"segment": max(rod, 1)})))
    return events
