"""Entrainment: the frequencies at which a rhythm with a reflex locks to a periodic input, one cycle to one.

A locked rhythm is a stable fixed point of the motion over one period of the input. It is found by Newton's method with
the exact derivative of the flow, and followed outwards from the rhythm's own frequency until it is lost: the edges of
the range. Outside, the phase between rhythm and input drifts, which is measured on the motion itself.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array, Mask, plain
from ..errors import InputError, argument
from ..findings import Finding, Warned
from ..result import Column, Result
from .loop_rhythm import LoopRhythm
from .orbits import Orbit, closed_orbit
from .outcome import extremes, fundamentals, wrapped
from .reflex import Loop, LoopFlow

#: First, largest and smallest step of the frequency, relative to the rhythm's own: the last is the error of an edge.
_FIRST, _LARGEST, EDGE = 0.02, 0.05, 1e-5
#: Room (1 - m)^2 below which an edge is expected, the part of the way to it that a step takes, and how much shorter
#: than the last one a step may be.
_CLOSE, _SHORT, _SHORTER = 0.25, 0.9, 20.0
#: Farthest frequency looked at, as a factor.
FARTHEST = 2.5
#: Periods that a motion is given before, and in which its drift is measured.
_WAIT, _WATCHED = 8, 20
#: Frequencies shown, unless given: so many, this part of the range beyond each edge.
_SHOWN, _BEYOND = 19, 0.25
_REACH, _PHASES, _RUNS = 0.5, 16, 6
_LARGEST_AMPLITUDE = 1e6


@dataclass(frozen=True, repr=False, eq=False)
class Entrainment(Result, Warned):
    """The range of frequencies at which a rhythm with a reflex locks to an input, as `ilg_circuit.reflex` returns it.

    Attributes
    ----------
    rhythm : LoopRhythm
        The rhythm without the input.
    amplitude : float
        Amplitude F of the input, a sine, in units of the tonic input.
    low, high : float
        Edges of the range [Hz]; NaN if the rhythm does not lock at its own frequency.
    frequency : ndarray (n,)
        Frequencies of the input [Hz].
    locked : ndarray (n,)
        Whether the rhythm locks at each.
    drift : ndarray (n,)
        Turns by which the rhythm gains on the input in each period of it; 0 where it locks.
    output_lag, angle_lag : ndarray (n,)
        Degrees by which the first unit's output and angle lag the input; NaN where they drift.
    angle : ndarray (n,)
        Half the peak-to-peak of the angle [rad].
    """

    presenter: ClassVar[str] = "entrainment"

    rhythm: LoopRhythm
    amplitude: float
    low: float
    high: float
    frequency: Array
    locked: Mask
    drift: Array
    output_lag: Array
    angle_lag: Array
    angle: Array

    @property
    def own(self) -> float:
        """Frequency of the rhythm without the input [Hz]."""
        assert self.rhythm.period is not None
        return 1 / self.rhythm.period

    @property
    def findings(self) -> tuple[Finding, ...]:
        """A finding where an edge of the range was not reached, or where there is no range."""
        if not self.low <= self.high:
            return (Finding("entrainment-none", values={"amplitude": self.amplitude}),)
        ends = ((self.low, self.own / FARTHEST), (self.high, self.own * FARTHEST))
        return tuple(
            Finding("entrainment-wide", values={"frequency": edge})
            for edge, farthest in ends
            if abs(edge / farthest - 1) < 1e-9
        )

    def table(self) -> tuple[Column, ...]:
        """Return frequency, locked (1 or 0), drift, lags of output and angle, angle."""
        return (
            Column("frequency", self.frequency, "Hz", over=True),
            Column("locked", self.locked.astype(int).tolist(), ""),
            Column("drift", self.drift, ""),
            Column("output_lag_deg", self.output_lag, ""),
            Column("angle_lag_deg", self.angle_lag, ""),
            Column("angle", self.angle, "rad"),
        )

    def to_dict(self) -> dict[str, Any]:
        """Return the range and the rhythm's own frequency, and a row a frequency."""
        loop = self.rhythm.loop
        names = ("frequency_Hz", "locked", "drift_turns", "output_lag_deg", "angle_lag_deg", "angle_rad")
        numbers = (self.drift, self.output_lag, self.angle_lag, self.angle)
        columns = [self.frequency.tolist(), self.locked.tolist(), *(plain(values) for values in numbers)]
        low, high = plain(np.array([self.low, self.high]))
        return {
            "amplitude": self.amplitude,
            "reflex_per_rad": loop.gain,
            "own_frequency_Hz": self.own,
            "low_Hz": low,
            "high_Hz": high,
            "warnings": list(self.warnings),
            "rows": [dict(zip(names, row, strict=True)) for row in zip(*columns, strict=True)],
        }


def entrainment(
    rhythm: LoopRhythm,
    amplitude: float,
    frequencies: ArrayLike | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Entrainment:
    """Return where ``rhythm`` locks to a sine of ``amplitude``, and phases or drifts at ``frequencies`` [Hz] (n,).

    Raises InputError for an amplitude that is not positive, frequencies out of range, or a rhythm that is none.
    """
    if not 0 < amplitude <= _LARGEST_AMPLITUDE:
        raise InputError(f"{argument('entrain')} is {amplitude:g}; give the amplitude of an input, such as 0.1")
    if rhythm.period is None or rhythm.state is None:
        raise InputError("the loop comes to rest or is undecided without an input: there is no rhythm to entrain")
    own = 1 / rhythm.period
    asked = np.array([own]) if frequencies is None else np.asarray(frequencies, dtype=float)
    if asked.ndim != 1 or not len(asked) or not ((asked > own / 100) & (asked < own * 100)).all():
        raise InputError(f"frequencies: give numbers within a factor of 100 of the rhythm's own, {own:.4g} Hz")
    tongue = _Tongue(rhythm, amplitude)
    edges = tongue.edge(own / FARTHEST), tongue.edge(own * FARTHEST)
    given = _shown(own, *edges) if frequencies is None else asked
    rows = []
    for k, frequency in enumerate(given.tolist()):
        rows.append(tongue.at(frequency, *edges))
        if progress:
            progress(k + 1, len(given))
    locked, drift, output_lag, angle_lag, angle = np.array(rows).T
    return Entrainment(rhythm, amplitude, *edges, given, locked > 0, drift, output_lag, angle_lag, angle)


def _shown(own: float, low: float, high: float) -> Array:
    if not low <= high:
        return np.linspace(0.8, 1.2, _SHOWN) * own
    beyond = _BEYOND * (high - low)
    return np.linspace(max(low - beyond, own / FARTHEST), min(high + beyond, own * FARTHEST), _SHOWN)


class _Tongue:
    """The locked states of a rhythm under an input of one amplitude, by frequency [Hz]."""

    def __init__(self, rhythm: LoopRhythm, amplitude: float) -> None:
        self.rhythm, self.amplitude = rhythm, amplitude
        assert rhythm.state is not None
        assert rhythm.period is not None
        self.size = float(np.abs(rhythm.state).max())
        self.known: dict[float, Orbit] = {}
        own = 1 / rhythm.period
        next((True for guess in self._guesses(own) if self._orbit(own, guess) is not None), False)

    def _guesses(self, own: float) -> Iterator[Array]:
        """Yield states near which a locked motion may be: those of the rhythm's phases, then of longer and longer runs.

        A weak lock is near a phase of the free rhythm, and takes long; of a strong one it is the reverse.
        """
        yield from (self._free_state(k / _PHASES) for k in range(_PHASES))
        flow, state = self._flow(own), self._free_state()
        for _ in range(_RUNS):
            for stretch in flow.stretches(state, _WAIT / own):
                state = stretch.states(stretch.length)[0]
            yield state
            state[-2:] = 0.0, 1.0

    def _flow(self, frequency: float) -> LoopFlow:
        return LoopFlow(self.rhythm.loop.forced(self.amplitude, frequency))

    def _free_state(self, phase: float = 0.0) -> Array:
        """Return the state of the free rhythm, at a ``phase`` in turns, as the input begins."""
        assert self.rhythm.state is not None
        assert self.rhythm.period is not None
        state = self.rhythm.state
        for stretch in self.rhythm.flow.stretches(state, phase * self.rhythm.period):
            state = stretch.states(stretch.length)[0]
        return np.append(state, [0.0, 1.0])

    def _orbit(self, frequency: float, guess: Array) -> Orbit | None:
        """Return the stable locked motion near ``guess``, its clock at zero; None without one."""
        guess = np.append(guess[:-2], [0.0, 1.0])
        orbit, _ = closed_orbit(self._flow(frequency), guess, 1 / frequency, self.size, _REACH, clocked=2)
        if orbit is None or np.abs(np.linalg.eigvals(orbit.monodromy[:-2, :-2])).max() >= 1:
            return None
        self.known[frequency] = orbit
        return orbit

    def _near(self, frequency: float) -> Array:
        """Return a state near which the locked motion at a frequency may be: on the line through the two nearest."""
        nearest = sorted(self.known, key=lambda f: abs(f - frequency))[:2]
        first = self.known[nearest[0]].state
        if len(nearest) < 2:
            return first
        part = (frequency - nearest[0]) / (nearest[1] - nearest[0])
        return np.asarray(first + part * (self.known[nearest[1]].state - first))

    def edge(self, farthest: float) -> float:
        """Return the frequency [Hz] at which the lock is lost on the way from the rhythm's own to the ``farthest``.

        Where it meets its unstable twin, a multiplier comes to 1 as the root of the distance does: steps are taken to
        short of where that is expected.
        """
        if not self.known:
            return np.nan
        own = next(iter(self.known))
        way = 1.0 if farthest > own else -1.0
        at, step, grows, room = own, _FIRST * own, 1.5, _room(self.known[own])
        while step > EDGE * own and at != farthest:
            following = min(at + step, farthest) if way > 0 else max(at - step, farthest)
            if self._orbit(following, self._near(following)) is None:
                step, grows = step / 2, 1.0
                continue
            before, room = room, _room(self.known[following])
            moved, at = abs(following - at), following
            step, grows = min(grows * step, _LARGEST * own), 1.5
            if room < min(before, _CLOSE):
                step = min(step, max(_SHORT * room * moved / (before - room), step / _SHORTER, 2 * EDGE * own))
        return at

    def at(self, frequency: float, low: float, high: float) -> tuple[float, float, float, float, float]:
        """Return whether the rhythm locks (1 or 0), drift, lags of output and angle [deg], amplitude of the angle."""
        flow = self._flow(frequency)
        if low <= frequency <= high:
            orbit = self._orbit(frequency, self._near(frequency))
            if orbit is not None:
                cycle = list(flow.stretches(orbit.state, orbit.period))
                units = flow.loop.units
                first = fundamentals(cycle, flow.curves, orbit.period)[[0, units]]
                ends = extremes(cycle, flow.curves)
                output, angle = wrapped(-np.degrees(np.angle(1j * first)))  # the input's own is -1j
                return 1.0, 0.0, float(output), float(angle), float((ends[1] - ends[0])[units] / 2)
        return 0.0, *drifting(flow.loop, self._free_state()[:-2])


def _room(orbit: Orbit) -> float:
    """Return (1 - m)^2 of the largest multiplier m: it falls to zero in proportion to the distance of an edge."""
    return float(1 - np.abs(np.linalg.eigvals(orbit.monodromy[:-2, :-2])).max()) ** 2


def drifting(loop: Loop, state: Array, wait: int = _WAIT, watched: int = _WATCHED) -> tuple[float, float, float, float]:
    """Return the drift in turns a period of the input, two NaN for the lags, and the amplitude of the angle [rad].

    The motion under the input of ``loop`` starts as ``state`` without its clock, and is watched over so many periods.
    The drift is counted where the first unit's extensor turns off.
    """
    assert loop.forcing is not None
    flow, period = LoopFlow(loop), 1 / loop.forcing.frequency
    extensor = loop.network.units[0][0]
    late = []
    passed: list[float] = []
    for stretch in flow.stretches(np.append(state, [0.0, 1.0]), (wait + watched) * period):
        if stretch.begin >= wait * period:
            late.append(stretch)
            if stretch.switched == extensor and not stretch.active[extensor]:
                passed.append(stretch.end)
    low, high = extremes(late, flow.curves)
    rate = (len(passed) - 1) / (passed[-1] - passed[0]) if len(passed) > 1 else 0.0
    return rate * period - 1, np.nan, np.nan, float((high - low)[loop.units] / 2)
