"""Computes what relaxations of the voltage or the charge of a strip make of its drive, for many time constants at once.

A displacement is linear in the gains of its law, so that the waves of a grid of time constants, once
computed, serve every law of bending and every stretch of a record.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array
from ..circuit.strip import strip_netlist
from ..drive import PiecewiseLinear
from ..errors import SolveError
from ..solve.modes import modes_of
from ..solve.state_space import state_space
from ..solve.waves import mode_waves
from ..strip.actuator import Actuator
from ..strip.couplings import ChargeCoupling, VoltageRelaxations
from .modal import second_order_waves
from .motion_laws import MotionLaw

#: Time constants of the grid, from so many sampling intervals to so many times the record, and so many a decade.
_SHORTEST, _LONGEST, _A_DECADE = 0.03, 300.0, 16
#: Times of the grid through which a wave is interpolated, and its weights for them by powers of the distance from their
#: middle, in steps of the grid.
_POINTS = 8
_MIDDLE = (_POINTS - 1) / 2
_WEIGHTS = np.linalg.inv(np.vander(np.arange(_POINTS) - _MIDDLE, increasing=True).T)
#: Relative distance of a pole and a time constant below which the latter is moved.
_NEAR = 1e-4
#: Contribution of a mode, relative to the whole, below which it is left out.
_FELT = 1e-12
#: Time constant [s] of a relaxation that a source is computed through.
_DELAY = 0.0123
#: For answers of modes that may grow beyond all numbers.
_GROWING = np.errstate(over="ignore", invalid="ignore")


@dataclass(frozen=True, eq=False)
class Source:
    """The displacement without delay of a gain of 1 m/V: ``direct`` times the drive, and modes of ``poles`` [1/s].

    Modes that grow have no finite answers, and no law is fitted with them.
    """

    poles: NDArray[Any]
    amounts: NDArray[Any]
    direct: float

    @classmethod
    def of(cls, actuator: Actuator, charge: bool, beam: str) -> Source:
        """Return the source of a strip on a ``beam``, by the ions' ``charge`` of a linear circuit or their voltage."""
        kind = ChargeCoupling if charge else VoltageRelaxations
        # a dynamic beam takes no voltage without delay: a relaxation, whose pole is divided out again
        delayed = beam == "dynamic"
        law = kind(gain_1=1.0, time_1=_DELAY) if delayed else kind(instantaneous=1.0)
        # what follows the voltage does not depend on a nonlinear circuit without an electrode resistance
        system = state_space([strip_netlist(replace(actuator, coupling=law), beam=beam).linearised()])
        row = system.output_names.index("displacement")
        direct, modes = float(system.d[0, row, 0]), modes_of(system)
        if modes is None:
            raise SolveError("the modes of the strip cancel")
        poles, amounts = modes.poles[0], modes.shown[0, row] * modes.excited[0, :, 0]
        if delayed:
            others = np.abs(poles * _DELAY + 1) > _NEAR
            poles, amounts = poles[others], (amounts * (1 + poles * _DELAY))[others]
        size = np.abs(amounts / poles)
        felt = size > _FELT * size.max(initial=abs(direct))
        return cls(poles[felt], amounts[felt], direct)

    @_GROWING
    def own(self, drive: PiecewiseLinear, t: Array) -> NDArray[Any]:
        """Return the waves (s, samples) of the modes under a ``drive``."""
        return mode_waves(self.poles, drive, t)

    @_GROWING
    def through(self, poles: NDArray[Any], drive: PiecewiseLinear, t: Array, own: NDArray[Any]) -> NDArray[Any]:
        """Return the source's answer to a ``drive`` through 1/(s - pole) (poles, samples), for ``poles`` [1/s] (n,).

        ``own`` are the waves of its modes.
        """
        if len(self.poles):
            close = np.abs(poles[:, None] - self.poles).min(axis=1) < _NEAR * np.abs(poles)
            poles = np.where(close, poles * (1 + 2 * _NEAR), poles)
        share = self.amounts / (self.poles - poles[:, None])
        return (self.direct - share.sum(axis=1))[:, None] * mode_waves(poles, drive, t) + share @ own

    @_GROWING
    def answer(self, drive: PiecewiseLinear, t: Array, own: NDArray[Any]) -> Array:
        """Return the displacement (samples,) without delay; ``own`` are the waves of the modes."""
        return np.asarray(self.direct * drive.value(t) + np.real(self.amounts @ own))


class Waves:
    """The displacements of relaxations, gain 1 m/V, at ``t`` [s] since the onset, negative ones at rest.

    ``charge`` says what is relaxed: the charge of the ions, or the voltage across them.
    """

    def __init__(
        self, t: Array, drive: PiecewiseLinear, actuator: Actuator, charge: bool, beam: str = "static"
    ) -> None:
        self._drive, self._after = drive.from_rest(), t >= 0
        self._later, self.samples = t[self._after], len(t)
        self.source = Source.of(actuator, charge, beam)
        step, last = float(np.median(np.diff(self._later))), float(self._later[-1])
        #: Shortest and longest time constant [s] that a fit begins with.
        self.band = max(2 * step, 1e-4 * last), 4 * last
        lowest, highest = max(_SHORTEST * step, 1e-6 * last), _LONGEST * last
        self.times = np.geomspace(lowest, highest, int(np.log10(highest / lowest) * _A_DECADE) + 2)

    @cached_property
    def direct(self) -> Array:
        """The wave (samples,) without a relaxation."""
        return self._whole(self.source.answer(self._drive, self._later, self._own)[None])[0]

    def exact(self, times: Array) -> Array:
        """Return the waves (n, samples) of relaxations of ``times`` [s] (n,)."""
        return self._whole(np.real(self._through(-1 / times)) / times[:, None])

    @cached_property
    def grid(self) -> Array:
        """The waves (times, samples) of all time constants of the grid."""
        return self.exact(self.times)

    def relaxed(self, time: float) -> tuple[Array, Array]:
        """Return the wave (samples,) of one relaxation and its derivative by the logarithm of its ``time`` [s].

        Both are interpolated between the times of the grid that are nearest, to about 1e-7 and 1e-6 of the wave. Raises
        SolveError where modes of the strip grow beyond all numbers.
        """
        step = np.log(self.times[1] / self.times[0])
        x = float(np.log(np.clip(time, self.times[0], self.times[-1]) / self.times[0])) / step
        k = min(max(int(x) - _POINTS // 2 + 1, 0), len(self.times) - _POINTS)
        powers = (x - k - _MIDDLE) ** np.arange(_POINTS)
        steeper = np.arange(_POINTS) * np.append(0.0, powers[:-1]) / step
        near = self.grid[k : k + _POINTS]
        if not np.isfinite(near).all():
            raise SolveError("the modes of the strip grow beyond all numbers")
        return (_WEIGHTS @ powers) @ near, (_WEIGHTS @ steeper) @ near

    def fractional(self, time: float, exponent: float) -> Array:
        """Return the wave (samples,) of 1/(1 + (s tau)^a), by its density over relaxations."""
        x = np.log(self.times / time)
        # between the logarithms of the times; what relaxes faster than all has no delay
        middle = np.concatenate([x[:1], (x[1:] + x[:-1]) / 2, [np.inf]])
        half = np.pi * exponent / 2
        below = 0.5 + np.arctan(np.tan(half) * np.tanh(exponent * middle / 2)) / (np.pi * exponent)
        return np.asarray(below[0] * self.direct + np.diff(below) @ self.grid)

    def second_order(self, damping: Array, frequency: Array) -> Array:
        """Return the waves (n, 2, samples) of wn^2/(s^2 + 2 zeta wn s + wn^2) and of s wn over the same."""
        made = second_order_waves(damping, frequency, self._through)
        return self._whole(made.reshape(-1, len(self._later))).reshape(*made.shape[:2], -1)

    def overdamped(self, damping: float, frequency: float) -> tuple[Array, Array]:
        """Return the waves (2, samples) of `second_order` for one damping above 1: differences of two relaxations.

        And their derivatives (2, 2, samples) by the logarithms of damping and frequency.
        """
        root = np.sqrt(damping**2 - 1)
        slow, fast = (damping + root) / frequency, (damping - root) / frequency
        (a, of_a), (b, of_b) = self.relaxed(slow), self.relaxed(fast)
        apart, mean = slow - fast, np.sqrt(slow * fast)
        first, second = (slow * a - fast * b) / apart, mean * (b - a) / apart
        by_slow = [slow * (a + of_a - first) / apart, second / 2 - (mean * of_a + slow * second) / apart]
        by_fast = [-fast * (b + of_b - first) / apart, second / 2 + (mean * of_b + fast * second) / apart]
        both = np.array([by_slow, by_fast])
        return np.array([first, second]), np.array([damping / root * (both[0] - both[1]), -both.sum(axis=0)])

    @cached_property
    def _own(self) -> NDArray[Any]:
        return self.source.own(self._drive, self._later)

    def _through(self, poles: NDArray[Any]) -> NDArray[Any]:
        return self.source.through(poles, self._drive, self._later, self._own)

    def _whole(self, later: Array) -> Array:
        """Return waves (n, samples) of all samples from those since the onset."""
        found = np.zeros((len(later), self.samples))
        found[:, self._after] = later
        return found


def displacements(law: MotionLaw, values: Array, waves: Waves) -> Array:
    """Return the displacements [m] (k, samples) of a ``law`` that relaxes, of ``values`` (k, n) of its parameters."""
    names = [p.name for p in law.parameters]
    signed = values * [-1.0 if name in law.negative else 1.0 for name in names]
    columns = dict(zip((name.removeprefix("coupling_") for name in names), signed.T, strict=True))
    found = np.zeros((len(values), waves.samples))
    if law.follows_charge:
        found += columns["instantaneous"][:, None] * waves.direct
    for k in range(1, law.relaxations + 1):
        times, place = np.unique(columns[f"time_{k}"], return_inverse=True)
        found += columns[f"gain_{k}"][:, None] * waves.exact(times)[place.ravel()]
    if law.fractional:
        shapes = zip(columns["fractional_time"].tolist(), columns["fractional_exponent"].tolist(), strict=True)
        made = np.array([waves.fractional(*shape) for shape in shapes])
        found += columns["fractional_gain"][:, None] * made
    return found
