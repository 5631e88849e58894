"""Margins of a loop: gain, phase, delay, disk and the largest sensitivity, for many samples of a strip at once."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import numpy as np

from ..arrays import Array, ComplexArray, Mask
from .laws import Law
from .plant import Plant, responses

#: Largest abs(S) that is allowed: the loop keeps 1/1.6 of the way from the point -1.
MOST_SENSITIVE = 1.6
#: Frequencies at which loops are judged, and how far they go beyond the slowest and the fastest pole.
_POINTS, _BELOW, _ABOVE = 1200, 1e-3, 1e2
#: Share of the samples that may be worse than a 5 % value.
_TAIL = 0.05


@dataclass(frozen=True, eq=False)
class Margins:
    """The margins of loops (n,), one a sample: ``gain`` is the least factor by which the gain may rise.

    ``phase`` [rad] and ``delay`` [s] may be lost, ``disk`` is the radius of the symmetric disk margin, ``sensitivity``
    the largest abs(S), ``bandwidth`` [Hz] where the closed loop has lost 3 dB. A loop that is not ``stable`` has none:
    its margins are zero, its sensitivity infinite. A margin that nothing exhausts is infinite.
    """

    gain: Array
    phase: Array
    delay: Array
    disk: Array
    sensitivity: Array
    bandwidth: Array
    stable: Mask

    def of(self, what: str) -> dict[str, float]:
        """Return the margins of the ``nominal`` loop, those that 95 % of loops exceed (``5 %``), or the ``worst``."""
        found = {}
        for name in MARGINS:
            values = getattr(self, name)
            largest = name == "sensitivity"
            if what == "nominal":
                found[name] = float(values[0])
            elif what == "worst":
                found[name] = float(values.max() if largest else values.min())
            else:
                worse = math.floor(_TAIL * (len(values) - 1))  # so many are
                found[name] = float(np.sort(values)[-1 - worse if largest else worse])
        return found


#: The margins' names, as in `Margins`.
MARGINS = tuple(field.name for field in fields(Margins) if field.name != "stable")


def frequencies(plants: list[Plant], law: Law, points: int = _POINTS) -> Array:
    """Return angular frequencies [rad/s] at which a loop is judged, close together about resonances."""
    poles = np.concatenate([plant.poles for plant in plants])
    own = np.linalg.eigvals(law.a)
    sizes = np.abs(np.concatenate([poles, own]))
    sizes = sizes[sizes > 1e-9 * sizes.max()]
    gain = abs(plants[0].gain * law.response(np.array([sizes.min()]))[0])
    wide = np.geomspace(_BELOW * sizes.min(), _ABOVE * sizes.max() * max(1.0, min(gain, 1e3)), points)
    ringing = plants[0].poles[plants[0].poles.imag > 0]
    near = [abs(pole) * np.linspace(0.5, 1.5, points // 3) for pole in ringing]
    return np.unique(np.concatenate([wide, *near]))


def margins(plants: list[Plant], law: Law, delay: float = 0.0, points: int = _POINTS) -> Margins:
    """Return the margins of the loops of ``plants`` with ``law``, measured ``delay`` [s] late."""
    frequency = frequencies(plants, law, points)
    bare = responses(plants, frequency) * law.response(frequency)
    found = curve_margins(frequency, bare * np.exp(-1j * frequency * delay))
    # a delay takes a loop from stable to unstable only where the gain is 1: first at the delay margin
    stable = stable_without_delay(plants, law)
    if delay:
        stable = stable & (curve_margins(frequency, bare).delay > delay)
    for name in ("gain", "phase", "delay", "disk", "bandwidth"):
        getattr(found, name)[~stable] = 0.0
    found.sensitivity[~stable] = np.inf
    found.stable[:] = stable
    return found


def curve_margins(frequency: Array, loop: ComplexArray) -> Margins:
    """Return the margins of Nyquist curves ``loop`` (n, f) at angular frequencies (f,), all loops taken as stable."""
    n = len(loop)
    logs = np.log(frequency)
    size, phase = curve(loop)
    gain, lost, delay, bandwidth = (np.full(n, np.inf) for _ in range(4))
    turn = 2 * np.pi
    for k in range(n):
        crossing, angle, _ = crossings(frequency, loop[k])
        room = np.mod(angle + np.pi, turn)
        if len(crossing):
            lost[k] = np.minimum(room, turn - room).min()
            delay[k] = (room / crossing).min()
        cell = np.floor((phase[k] - np.pi) / turn)
        at = np.flatnonzero(cell[:-1] != cell[1:])
        if len(at):
            level = np.maximum(cell[at], cell[at + 1]) * turn + np.pi
            part = (level - phase[k, at]) / (phase[k, at + 1] - phase[k, at])
            there = size[k, at] + part * (size[k, at + 1] - size[k, at])
            gain[k] = np.exp(-there[there < 0]).min(initial=np.inf)
    closed = np.abs(loop / (1 + loop))
    low = closed < np.sqrt(0.5)
    for k in range(n):
        first = int(np.argmax(low[k]))
        bandwidth[k] = 0.0 if first == 0 and low[k, 0] else _crossed(logs, closed[k], first) / turn if first else np.inf
    sensitivity = _peak(np.abs(1 / (1 + loop)))
    disk = 1 / _peak(np.abs((1 - loop) / (1 + loop) / 2))
    return Margins(gain, lost, delay, disk, sensitivity, bandwidth, np.ones(n, dtype=bool))


def curve(loop: ComplexArray) -> tuple[Array, Array]:
    """Return the logarithm of the size of Nyquist curves (..., f), and their angle [rad] without jumps."""
    return np.log(np.abs(loop)), np.unwrap(np.angle(loop))


def crossings(frequency: Array, loop: ComplexArray) -> tuple[Array, Array, Mask]:
    """Return where the size of a curve (f,) goes through 1, in the unit of ``frequency``, its angle [rad] there, and
    whether it falls, each (crossings,).
    """
    logs, (size, phase) = np.log(frequency), curve(loop)
    at = np.flatnonzero((size[:-1] >= 0) != (size[1:] >= 0))
    part = size[at] / (size[at] - size[at + 1])
    crossing: Array = np.exp(logs[at] + part * (logs[at + 1] - logs[at]))
    return crossing, phase[at] + part * (phase[at + 1] - phase[at]), size[at] >= 0


def _crossed(logs: Array, closed: Array, k: int) -> float:
    """Return where the closed loop falls through -3 dB, between two frequencies."""
    a, b = np.log(closed[k - 1]), np.log(closed[k])
    part = (a + np.log(2) / 2) / (a - b)
    return float(np.exp(logs[k - 1] + part * (logs[k] - logs[k - 1])))


def _peak(values: Array) -> Array:
    """Return the largest of each row (n,), by a parabola through the highest points."""
    rows = np.arange(len(values))
    k = np.clip(values.argmax(axis=1), 1, values.shape[1] - 2)
    left, top, right = values[rows, k - 1], values[rows, k], values[rows, k + 1]
    bend = 2 * top - left - right
    with np.errstate(divide="ignore", invalid="ignore"):
        raised = top + np.where(bend > 0, (right - left) ** 2 / (8 * bend), 0.0)
    return np.asarray(
        np.maximum(np.where(np.isfinite(raised) & (top >= np.maximum(left, right)), raised, top), values.max(axis=1))
    )


def stable_without_delay(plants: list[Plant], law: Law) -> Mask:
    """Return which loops (n,) are stable, by their poles."""
    a, b, c = (np.stack([getattr(plant, part) for plant in plants]) for part in ("a", "b", "c"))
    s, n = a.shape[1], len(law.out)
    whole = np.zeros((len(plants), s + n, s + n))
    whole[:, :s, :s] = a + law.measured * b[:, :, None] * c[:, None, :]
    whole[:, :s, s:] = b[:, :, None] * law.out
    whole[:, s:, :s] = law.into_measured[:, None] * c[:, None, :]
    whole[:, s:, s:] = law.a
    return np.asarray(np.linalg.eigvals(whole).real.max(axis=1) < 0)


def largest_delay(plants: list[Plant], law: Law, most: float) -> float:
    """Return the largest delay [s] of the measurement up to which all loops keep abs(S) <= ``most``; 0 for none."""
    if not stable_without_delay(plants, law).all():
        return 0.0
    frequency = frequencies(plants, law)
    bare = responses(plants, frequency) * law.response(frequency)
    bound = float(curve_margins(frequency, bare).delay.min())

    def holds(delay: float) -> bool:
        loop = bare * np.exp(-1j * frequency * delay)
        return delay < bound and bool(_peak(np.abs(1 / (1 + loop))).max() <= most)

    if not holds(0.0):
        return 0.0
    if not np.isfinite(bound):
        return np.inf
    # the first of a fine scan that does not hold, then halving
    good = 0.0
    for delay in np.linspace(0.0, bound, 60)[1:].tolist():
        if not holds(delay):
            break
        good = delay
    bad = delay
    for _ in range(25):
        middle = (good + bad) / 2
        good, bad = (middle, bad) if holds(middle) else (good, middle)
    return good
