"""What drives an arm: activation of each segment over time, linear between given times."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ..errors import InputError
from .compiled import Array
from .lattice import Arm

#: Where a muscle or an eigenstrain sits: the edge of the face towards +normal, that of the other face, the rods.
CHANNELS = ("edge +normal", "edge -normal", "across")

#: Largest eigenstrain of an edge: beyond it an edge would vanish or the arm's linear elasticity mean nothing.
LARGEST_STRAIN = 0.5


@dataclass(frozen=True)
class Activation:
    """Activations at ``time`` [s] (t,), ``values`` (t, n, 3) for the `CHANNELS` of n segments, linear in between.

    In the ``beam`` formulation a value is an eigenstrain, l_rest = l0 (1 + value); in ``yekutieli`` an activation in
    [0, 1]. Before the first and after the last time the nearest value holds. ``text`` names the activation.
    """

    time: Array
    values: Array
    text: str = "activation"

    def at(self, times: ArrayLike) -> Array:
        """Values at ``times`` [s] (k,): (k, n, 3)."""
        wanted = np.asarray(times, dtype=np.float64)
        flat = self.values.reshape(len(self.time), -1)
        columns = [np.interp(wanted, self.time, column) for column in flat.T]
        return np.stack(columns, axis=-1).reshape(*wanted.shape, *self.values.shape[1:])


def activation(arm: Arm, time: ArrayLike, values: ArrayLike, text: str = "activation") -> Activation:
    """The `Activation` of ``arm`` from values (t, n), or (t, n, 3) for the `CHANNELS`.

    A positive value of a (t, n) array bends the arm towards +normal. ``beam``: the eigenstrain eps, -eps on the edge
    towards +normal, +eps on the other. ``yekutieli``: max(0, a) and max(0, -a) activate the two edges' muscles.
    Raises InputError naming the first value that is not finite or out of range.
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
    low, high = (-LARGEST_STRAIN, LARGEST_STRAIN) if arm.formulation == "beam" else (0.0, 1.0)
    lowest = low if given.ndim == 3 else -high
    wrong = np.argwhere(~((given >= lowest) & (given <= high)))
    if len(wrong):
        at, segment = wrong[0][:2]
        raise InputError(
            f"activation of segment {segment + 1} at {t[at]:g} s is {given[tuple(wrong[0])]:g}; "
            f"give {lowest:g} to {high:g}"
        )
    if given.ndim == 2:
        one, two = (-given, given) if arm.formulation == "beam" else (np.maximum(given, 0), np.maximum(-given, 0))
        given = np.stack([one, two, np.zeros_like(given)], axis=-1)
    return Activation(t.copy(), np.ascontiguousarray(given), text)


def passive(arm: Arm) -> Activation:
    """No activation at all."""
    return activation(arm, [0.0], np.zeros((1, arm.segments)), "passive")


def sampled(
    arm: Arm, signal: Callable[[Array], Array], times: ArrayLike, text: str = "activation"
) -> Activation:
    """An `Activation` from a function of time [s] (t,) that returns values (t, n) or (t, n, 3)."""
    points = np.asarray(times, dtype=np.float64)
    return activation(arm, points, signal(points), text)


def sine(arm: Arm, amplitude: float, period: float, duration: float) -> Activation:
    """The bounded sine amplitude sin(2 pi t/period) in every segment alike, 200 points a period."""
    for name, value in (("period", period), ("duration", duration)):
        if not (np.isfinite(value) and value > 0):
            raise InputError(f"{name} {value:g} s must be more than zero")
    count = int(np.ceil(200 * duration / period))
    if count > 5_000_000:
        raise InputError(f"period {period:g} s is too short for {duration:g} s; at most 25000 periods are possible")
    times = np.append(np.arange(count) * (period / 200), duration)
    wave = amplitude * np.sin(2 * np.pi * times / period)
    text = f"{amplitude:.3g} sin(2 pi t/{period:.6g} s)"
    return activation(arm, times, np.repeat(wave[:, None], arm.segments, axis=1), text)


def reach(arm: Arm, *, bend: float, wave: float, speed: float, duration: float, level: float = 1.0) -> Activation:
    """The octopus' reach in the ``yekutieli`` formulation: a bend at the base, then a stiffening wave to the tip.

    For ``bend`` [s] the muscles of one face of the first third contract; then all muscles, longitudinal and across,
    are activated to ``level`` behind a front that runs from base to tip at ``speed`` [m/s] and is ``wave`` [m] long.
    """
    if arm.formulation != "yekutieli":
        raise InputError("the reach is a wave of stiffness: choose the formulation yekutieli")
    times = np.linspace(0.0, duration, max(2, int(np.ceil(200 * duration)) + 1))
    x = (np.arange(arm.segments) + 0.5) * arm.segment_length
    front = speed * np.maximum(times - bend, 0.0)
    behind = np.clip((front[:, None] - x + wave) / wave, 0.0, 1.0) * (times > bend)[:, None]
    onset = np.clip(times / (0.2 * bend), 0.0, 1.0)[:, None]
    bending = 0.3 * onset * (x < arm.length / 3) * np.clip(1 - (times[:, None] - bend) / (0.2 * bend), 0.0, 1.0)
    values = level * np.stack([np.maximum(behind, bending), behind, behind], axis=-1)
    return activation(arm, times, np.clip(values, 0.0, 1.0), "reach")
