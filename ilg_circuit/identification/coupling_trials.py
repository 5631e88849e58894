"""Fits laws of bending to displacements quickly, to compare them, with their gains as linear terms.

Only time constants are searched (variable projection, Golub and Pereyra 1973); gains of either sign, rest and drift
follow from them by linear least squares. Several files share the law; each has a gain of its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..arrays import Array
from ..errors import IlgError, InputError
from ..fit.criteria import effective_samples, structured
from ..fit.identifiability import DETERMINED
from ..fit.minimise import descended
from ..measurements.rest import Rest
from ..strip.actuator import Actuator
from .coupling_waves import Waves
from .motion import DisplacementData
from .motion_laws import EC31, MotionLaw
from .relaxation_search import RelaxationSearch, axis_of, with_shape
from .start import CouplingSearch

#: Largest number of readings in the comparison of laws.
_MOST = 2000
_STARTS = 3
#: Ends of a descent: relative change of the sum of squares, and evaluations, of which a flat valley needs many.
_TOLERANCE, _EVALUATIONS = 1e-7, 400
#: Step of a logarithm or logit for derivatives by differences.
_STEP = 1e-5
#: Damping above which d(s) is taken for two relaxations, whose waves are interpolated.
_OVERDAMPED = 1.1
#: Ratio of two time constants below which two relaxations are one.
_DISTINCT = 1.5
#: Largest change of a logarithm from its start.
_FAR = 8.0


@dataclass(frozen=True, eq=False)
class Trial:
    """A quick fit of a ``law`` up to ``end`` [s]: ``shape`` (p,) its constants, ``gains`` (k,) [m/V] times the axis.

    ``errors`` (n,) are standard errors of gains and constants, relative to their values. ``terms`` linear terms, the
    rest and a drift, are fitted beside, or a drift of ``held`` [m/s] is subtracted.
    """

    law: MotionLaw
    end: float
    shape: Array
    gains: Array
    errors: Array
    residuals: Array
    size: float
    t: Array
    terms: int
    held: float
    beam: str

    @property
    def rmse(self) -> float:
        return float(np.sqrt(np.mean(self.residuals**2)))

    @property
    def unknowns(self) -> int:
        return len(self.shape) + len(self.gains)

    @property
    def determined(self) -> bool:
        """Return whether the data determine every parameter, and the law has no simpler name."""
        return not self.against

    @property
    def against(self) -> str:
        """The reason why the law is not chosen, empty if there is none."""
        return reason_against(self.law, self.shape, self.gains, self.errors)


def reason_against(law: MotionLaw, shape: Array, gains: Array, errors: Array) -> str:
    """Return why the data do not determine a law, or it has another name; empty if nothing is against it.

    Two relaxations of the voltage whose response begins in the direction in which it ends are d(s) with zeta' above 1.
    """
    if law == EC31:
        if not gains[0] * gains[1] > 0:
            return "no zero on the left"
    else:
        times = shape[: law.relaxations]
        if (np.sort(times)[1:] < _DISTINCT * np.sort(times)[:-1]).any():
            return "relaxations with one time constant"
        two = law.relaxations == 2 and not law.follows_charge
        if two and gains.sum() * (gains / times).sum() > 0:
            return "it is d(s) with zeta' above 1"
    return "" if (errors <= DETERMINED).all() else f"not determined: standard error over {DETERMINED:.0%}"


class Strand:
    """One file's displacement for trials: ``data`` (the whole record), its rest, and its waves."""

    def __init__(
        self,
        data: DisplacementData,
        rest: Rest,
        actuator: Actuator,
        ratio: float,
        most: int = _MOST,
        beam: str = "static",
    ) -> None:
        channel = data.channel
        step = -(-len(channel.time) // most)
        keep = np.arange(0, len(channel.time), step)
        self.t, self.values = channel.time[keep], channel.values[keep] - data.reference
        self.since, self.drive = data.since(channel)[keep], data.drive
        self.rest, self.actuator, self.ratio = rest, actuator, ratio
        self.data, self.most, self.beam = data, most, beam
        self._searches: dict[str, CouplingSearch | RelaxationSearch] = {}
        self._waves: dict[bool, Waves] = {}

    def like(self, most: int | None = None, beam: str | None = None) -> Strand:
        """Return the same with another number of readings at ``most``, or on another ``beam``."""
        if (most or self.most, beam or self.beam) == (self.most, self.beam):
            return self
        other = Strand(self.data, self.rest, self.actuator, self.ratio, most or self.most, beam or self.beam)
        if other.most == self.most and EC31.name in self._searches:  # which does not know of the beam
            other._searches[EC31.name] = self._searches[EC31.name]
        return other

    def waves(self, law: MotionLaw) -> Waves:
        """Return the waves of what a law follows."""
        charge = law.follows_charge
        if charge not in self._waves:
            self._waves[charge] = Waves(self.since, self.drive, self.actuator, charge, self.beam)
        return self._waves[charge]

    def search(self, law: MotionLaw) -> CouplingSearch | RelaxationSearch:
        """Return the search for starting values of a law."""
        if law.name not in self._searches:
            self._searches[law.name] = (
                CouplingSearch(self.since, self.drive.from_rest(), self.ratio)
                if law == EC31
                else RelaxationSearch(self.since, self.drive, self.actuator, law, self.waves(law))
            )
        return self._searches[law.name]

    @cached_property
    def beside(self) -> Array:
        """The rest and the drift as linear terms (samples, 2)."""
        return np.column_stack([np.ones(len(self.t)), self.t])

    def trial(
        self,
        law: MotionLaw,
        end: float,
        near: Sequence[Array] = (),
        starts: int = _STARTS,
        tolerance: float = _TOLERANCE,
    ) -> Trial | None:
        """Return the fit of a law up to ``end`` [s], of several ``starts`` and the shapes ``near``; None without.

        A descent ends at a relative change of ``tolerance`` of the sum of squares. A drift is fitted or held as by
        `displacement.WindowSearch.attempt`.
        """
        drift = self.rest.bounds_drift
        best = self._best(law, end, near, starts, 1 + drift, 0.0, tolerance)
        if best is None or not drift:
            return best and best[0]
        found, slope = best
        held = self.rest.nearest(slope)
        if held != slope:
            best = self._best(law, end, [found.shape], 0, 1, held, tolerance)
        return best and best[0]

    def _best(
        self,
        law: MotionLaw,
        end: float,
        near: Sequence[Array],
        most: int,
        terms: int,
        held: float,
        tolerance: float,
    ) -> tuple[Trial, float] | None:
        count = int(np.searchsorted(self.t, end, side="right"))
        y, beside = self.values[:count] - held * self.t[:count], self.beside[:count, :terms]
        starts = list(near)
        if most:
            with suppress(InputError):
                every = self.search(law).starts(end, self.values - held * self.t, self.beside[:, :terms], most)
                starts += [shape_of(law, values) for values, _ in every]
        best: tuple[Array, _Projected] | None = None
        problem = _Projected(law, self.waves(law), y, beside)
        for start in starts:
            try:
                x = problem.descended(coordinates_of(law, start), tolerance)
            except (IlgError, ValueError, np.linalg.LinAlgError):
                continue
            if best is None or problem.squares(x) < problem.squares(best[0]) * (1 - 1e-6):
                best = x, problem
        if best is None:
            return None
        x = best[0]
        gains, slope = problem.amounts(x)
        size, t = float(np.ptp(self.values[:count])), self.t[:count]
        errors, residuals = problem.errors(x), problem.residuals(x)
        found = Trial(law, end, shape_at(law, x), gains, errors, residuals, size, t, terms, held, self.beam)
        return found, slope


class _Projected:
    """Residuals of a law by the logarithms of its constants, with its gains and ``beside`` as linear terms."""

    def __init__(self, law: MotionLaw, waves: Waves, y: Array, beside: Array) -> None:
        self.law, self.waves, self.y, self.beside = law, waves, y, beside
        self._at: Array | None = None

    def _solve(self, x: Array) -> None:
        if self._at is not None and np.array_equal(x, self._at):
            return
        basis, slopes = basis_of(self.law, self.waves, x, len(self.y))
        columns = np.vstack([basis, self.beside.T])
        self._size = np.linalg.norm(columns, axis=1)
        self._size[self._size == 0] = 1.0
        q, r = np.linalg.qr((columns / self._size[:, None]).T)
        self._q, self._r = q, r
        self._c = np.linalg.lstsq(r, q.T @ self.y, rcond=1e-12)[0] / self._size
        self._residuals = self.y - columns.T @ self._c
        self._along = np.einsum("pkn,k->pn", slopes, self._c[: len(basis)])
        self._count = len(basis)
        self._at = x.copy()

    def squares(self, x: Array) -> float:
        self._solve(x)
        return float(self._residuals @ self._residuals)

    def residuals(self, x: Array) -> Array:
        self._solve(x)
        return self._residuals

    def amounts(self, x: Array) -> tuple[Array, float]:
        """Return the gains, and the drift [m/s] if one is fitted."""
        self._solve(x)
        return self._c[: self._count], float(self._c[-1])

    def jacobian(self, x: Array) -> Array:
        self._solve(x)
        return -(self._along - (self._along @ self._q) @ self._q.T).T

    def descended(self, start: Array, tolerance: float) -> Array:
        """Return the coordinates of the minimum from ``start``. Raises SolveError or ValueError where there is none."""
        scale = float(np.abs(self.y).max()) or 1.0

        def residuals(x: Array) -> Array:
            if np.abs(x - start).max() > _FAR:
                raise ValueError("the fit ran away")
            return self.residuals(x) / scale

        return descended(
            residuals,
            lambda x: self.jacobian(x) / scale,
            start,
            ftol=tolerance,
            xtol=tolerance**0.8,
            most=_EVALUATIONS,
        )

    def errors(self, x: Array) -> Array:
        """Return relative standard errors of gains and constants, wider where residuals are autocorrelated."""
        self._solve(x)
        columns = np.column_stack([self._along.T, self._q @ self._r])
        size = np.linalg.norm(columns, axis=0)
        size[size == 0] = 1.0
        try:
            inverse = np.linalg.inv(np.linalg.qr(columns / size, mode="r")) / size[:, None]
        except np.linalg.LinAlgError:
            return np.full(len(x) + self._count, np.inf)
        samples = len(self.y)
        count = effective_samples(self._residuals) if structured(self._residuals) else float(samples)
        variance = self.squares(x) / max(samples - columns.shape[1], 1) * samples / count
        p = len(x)
        with np.errstate(over="ignore", invalid="ignore"):  # of displacements below 1e-154 m
            errors = np.sqrt(variance) * np.linalg.norm(inverse, axis=1)
            gains = errors[p : p + self._count] / self._size[: self._count] / np.abs(self._c[: self._count])
        return np.concatenate([gains, errors[:p]])


def basis_of(law: MotionLaw, waves: Waves, x: Array, count: int) -> tuple[Array, Array]:
    """Return the waves (k, samples) of a law's gains at coordinates ``x`` (p,), and their derivatives (p, k, samples).

    Only the first ``count`` samples.
    """
    shape = shape_at(law, x)
    if law == EC31:
        if shape[0] > _OVERDAMPED:
            made, turned = waves.overdamped(*shape.tolist())
            return made[:, :count], turned[:, :, :count]
        steps = np.exp(_STEP * np.array([[0, 0], [1, 0], [0, 1]]))
        made = waves.second_order(*(shape * steps).T)[..., :count]
        return made[0], (made[1:] - made[0]) / _STEP
    first = int(law.follows_charge)
    basis = np.zeros((first + law.relaxations + law.fractional, count))
    slopes = np.zeros((len(x), len(basis), count))
    if first:
        basis[0] = waves.direct[:count]
    for k in range(law.relaxations):
        wave, slope = waves.relaxed(shape[k])
        basis[first + k], slopes[k, first + k] = wave[:count], slope[:count]
    if law.fractional:
        at = [law.relaxations, law.relaxations + 1]

        def fractional(y: Array) -> Array:
            return waves.fractional(*shape_at(law, y)[at])[:count]

        basis[-1] = fractional(x)
        for k in at:
            slopes[k, -1] = (fractional(x + _STEP * np.eye(len(x))[k]) - basis[-1]) / _STEP
    return basis, slopes


def shape_of(law: MotionLaw, values: Array) -> Array:
    """Return the constants that are not gains, of a law's ``values``; of d(s), without its zero."""
    if law == EC31:
        return values[2:]
    return values[[k for k in range(len(values)) if k not in law.gains]]


def coordinates_of(law: MotionLaw, shape: Array) -> Array:
    """Return logarithms of time constants, and the logit of an exponent."""
    x = np.log(shape)
    if law.fractional:
        x[-1] -= np.log1p(-shape[-1])
    return x


def shape_at(law: MotionLaw, x: Array) -> Array:
    shape = np.exp(np.clip(x, -50, 50))
    if law.fractional:
        shape[-1] = shape[-1] / (1 + shape[-1])
    return shape


def begun(found: Trial, strand: Strand) -> tuple[MotionLaw, Array, float]:
    """Return the law with the signs of its gains, its values and the sign of the axis, as a fit begins with them."""
    if found.law == EC31:
        (low, high), (zeta, wn) = found.gains.tolist(), found.shape.tolist()
        zero = wn * low / high
        return found.law, np.array([abs(low) / strand.ratio * wn**2 / zero, zero, zeta, wn]), float(np.sign(low))
    count = int(np.searchsorted(strand.t, found.end, side="right"))
    basis, _ = basis_of(found.law, strand.waves(found.law), coordinates_of(found.law, found.shape), count)
    axis = axis_of(found.gains @ basis)
    law = replace(found.law, signs=tuple(np.sign(axis * found.gains).tolist()))
    return law, with_shape(law, np.abs(found.gains), found.shape), axis
