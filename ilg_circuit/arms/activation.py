"""Activation of an arm: a value for each segment over time, linear between given times."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array
from ..errors import InputError
from ..units import require_positive
from .lattice import Arm

#: Where a muscle or an eigenstrain sits: the edge of the face towards +normal, that of the other face, the rods.
CHANNELS = ("edge +normal", "edge -normal", "across")

#: Largest eigenstrain of an edge: beyond it an edge would vanish or the arm's linear elasticity mean nothing.
LARGEST_STRAIN = 0.5


@dataclass(frozen=True)
class Activation:
    """Activations at ``time`` [s] (t,), ``values`` (t, n, 3) for the `CHANNELS` of n segments, linear in between.

    In the formulations ``beam`` and ``chain`` a value is an eigenstrain, l_rest = l0 (1 + value); in ``yekutieli`` an
    activation in [0, 1]. Before the first and after the last time the nearest value holds. ``text`` names the
    activation.
    """

    time: Array
    values: Array
    text: str = "activation"

    def at(self, times: ArrayLike) -> Array:
        """Return the values at ``times`` [s] (k,): (k, n, 3)."""
        flat = resampled(times, self.time, self.values.reshape(len(self.time), -1))
        return flat.reshape(-1, *self.values.shape[1:])


def resampled(times: ArrayLike, time: Array, columns: Array) -> Array:
    """Return the values (k, n) at ``times`` (k,) of ``columns`` (t, n) that are linear between ``time`` (t,)."""
    wanted = np.asarray(times, dtype=np.float64)
    return np.stack([np.interp(wanted, time, column) for column in columns.T], axis=-1)


def activation(arm: Arm, time: ArrayLike, values: ArrayLike, text: str = "activation") -> Activation:
    """Return the `Activation` of ``arm`` from values (t, n), or (t, n, 3) for the `CHANNELS`.

    A positive value of a (t, n) array bends the arm towards +normal. ``beam``, ``chain``: the eigenstrain eps, -eps on
    the edge towards +normal, +eps on the other. ``yekutieli``: max(0, a) and max(0, -a) activate the two edges'
    muscles. Raises InputError naming the first value that is not finite or out of range.
    """
    try:
        t, given = np.asarray(time, dtype=np.float64), np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError):
        raise InputError("activation: time and values must be arrays of numbers") from None
    if t.ndim != 1 or len(t) == 0 or not np.isfinite(t).all() or (np.diff(t) <= 0).any():
        raise InputError("activation: times must be finite and ascending, in one dimension")
    wanted = (len(t), arm.segments)
    if given.shape not in (wanted, (*wanted, 3)):
        raise InputError(f"activation: values have the shape {given.shape}; give {wanted} or {(*wanted, 3)}")
    low, high = (-LARGEST_STRAIN, LARGEST_STRAIN) if arm.strained else (0.0, 1.0)
    lowest = low if given.ndim == 3 else -high
    wrong = np.argwhere(~((given >= lowest) & (given <= high)))
    if len(wrong):
        at, segment = wrong[0][:2]
        raise InputError(
            f"activation of segment {segment + 1} at {t[at]:g} s is {given[tuple(wrong[0])]:g}; "
            f"give {lowest:g} to {high:g}"
        )
    if given.ndim == 2:
        one, two = (-given, given) if arm.strained else (np.maximum(given, 0), np.maximum(-given, 0))
        given = np.stack([one, two, np.zeros_like(given)], axis=-1)
    return Activation(t.copy(), np.ascontiguousarray(given), text)


def corners(drive: Activation, tolerance: float) -> Array:
    """Return the times [s] at which ``drive`` leaves the line through its neighbours by over ``tolerance`` of its peak.

    At these a step must end; the other times only sample something smooth, and a step may pass over them.
    """
    largest = float(np.abs(drive.values).max())
    if len(drive.time) < 3 or largest == 0:
        return drive.time[[0, -1]]
    before, time, after = drive.time[:-2], drive.time[1:-1], drive.time[2:]
    part = ((time - before) / (after - before))[:, None, None]
    straight = drive.values[:-2] + part * (drive.values[2:] - drive.values[:-2])
    away = np.abs(drive.values[1:-1] - straight).max(axis=(1, 2))
    return np.concatenate([drive.time[:1], time[away > tolerance * largest], drive.time[-1:]])


def passive(arm: Arm) -> Activation:
    """Return an activation of zero."""
    return activation(arm, [0.0], np.zeros((1, arm.segments)), "passive")


def sampled(arm: Arm, signal: Callable[[Array], Array], times: ArrayLike, text: str = "activation") -> Activation:
    """Return an `Activation` from a function of time [s] (t,) that returns values (t, n) or (t, n, 3)."""
    points = np.asarray(times, dtype=np.float64)
    return activation(arm, points, signal(points), text)


def sine(arm: Arm, amplitude: float, period: float, duration: float) -> Activation:
    """Return the sine amplitude sin(2 pi t/period), bounded, equal in all segments, 200 points a period."""
    require_positive("period", period, "s")
    require_positive("duration", duration, "s")
    largest = LARGEST_STRAIN if arm.strained else 1.0
    if not abs(amplitude) <= largest:
        raise InputError(f"amplitude {amplitude:g} is out of range; give {-largest:g} to {largest:g}")
    count = int(np.ceil(200 * duration / period))
    if count > 5_000_000:
        raise InputError(f"period {period:g} s is too short for {duration:g} s; at most 25000 periods are possible")
    times = np.append(np.arange(count) * (period / 200), duration)
    values = amplitude * np.sin(2 * np.pi * times / period)
    text = f"{amplitude:.3g} sin(2 pi t/{period:.6g} s)"
    return activation(arm, times, np.repeat(values[:, None], arm.segments, axis=1), text)


def stiffening_wave(
    arm: Arm, duration: float, *, bend: float = 0.6, pull: float = 0.04, speed: float = 0.3, front: float = 0.06
) -> Activation:
    """Return the octopus' reach (``yekutieli`` formulation): a bend at the base, then a stiffening wave to the tip.

    Until ``bend`` [s] the muscles of the +normal face contract at the base, to the activation ``pull``; then all
    muscles, longitudinal and across, are fully activated behind a front that runs from the base to the tip at
    ``speed`` [m/s] and rises over ``front`` [m]. The defaults are chosen for `OCTOPUS` (assumed).
    """
    if arm.formulation != "yekutieli":
        raise InputError("the octopus' reach is a wave of stiffness: choose the formulation yekutieli")
    for name, value in (("bend", bend), ("speed", speed), ("front", front), ("duration", duration)):
        require_positive(f"wave: {name}", value)
    times = np.linspace(0.0, duration, max(2, int(np.ceil(200 * duration)) + 1))
    x = (np.arange(arm.segments) + 0.5) * arm.segment_length
    behind = _rise((speed * np.maximum(times - bend, 0.0)[:, None] - x) / front)
    bending = pull * _rise(times / bend)[:, None] * (x <= 0.28 * arm.length)
    values = np.stack([behind + bending * (1 - behind), behind, behind], axis=-1)
    return activation(arm, times, np.clip(values, 0.0, 1.0), "wave of stiffness")


def _rise(x: Array) -> Array:
    """Return a smooth rise from 0 at x <= 0 to 1 at x >= 1."""
    u = np.clip(x, 0.0, 1.0)
    return np.asarray(u * u * (3 - 2 * u))
