"""Finds starting values of a law of bending by linear fits on a grid of its time constants."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations, pairwise, product

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array
from ..drive import PiecewiseLinear
from ..errors import InputError
from ..strip.actuator import Actuator
from .coupling_waves import Waves
from .motion_laws import MotionLaw
from .start import CouplingSearch, thinned

#: Number of time constants of relaxations, and of a fractional one with its exponents.
_GRID, _FEWER, _EXPONENTS = 15, 9, (0.3, 0.5, 0.7, 0.85)
#: Ratio of two time constants of one law, at least, and of those of two starts.
_APART = 1.8
#: Largest number of candidates that are looked through for starts.
_MOST = 200


class RelaxationSearch:
    """Starting values of a law that relaxes, by linear fits on a grid of time constants; see `CouplingSearch`."""

    def __init__(
        self, t: Array, drive: PiecewiseLinear, actuator: Actuator, law: MotionLaw, waves: Waves | None = None
    ) -> None:
        assert law.kind is not None
        self.law = law
        if waves is None:
            self._keep = thinned(t)
            waves, self._t = Waves(t[self._keep], drive, actuator, law.follows_charge), t[self._keep]
        else:  # of all samples
            self._keep, self._t = np.arange(len(t)), t
        times = np.geomspace(*waves.band, _GRID)
        rows = [waves.direct[None]] if law.follows_charge else []
        first = len(rows)
        rows.append(waves.exact(times))
        relaxing = [
            chosen
            for chosen in combinations(range(_GRID), law.relaxations)
            if all(times[b] > _APART * times[a] for a, b in pairwise(chosen))
        ]
        chosen = [(*range(first), *(first + k for k in each)) for each in relaxing]
        shapes = [tuple(times[list(each)].tolist()) for each in relaxing]
        if law.fractional:
            others = list(product(np.geomspace(*waves.band, _FEWER).tolist(), _EXPONENTS))
            rows.append(np.array([waves.fractional(*each) for each in others]))
            pairs = list(product(range(len(relaxing)), range(len(others))))
            chosen = [(*chosen[j], first + _GRID + k) for j, k in pairs]
            shapes = [(*shapes[j], *others[k]) for j, k in pairs]
        self._waves = np.concatenate(rows)
        #: Rows of each candidate, and its constants in the order of the law's parameters.
        self._chosen: NDArray[np.intp] = np.array(chosen)
        self._shapes = np.array(shapes)

    def signed(self, end: float, displacement: Array, nuisance: Array) -> MotionLaw:
        """Return the law with the signs of the best linear fit up to ``end`` [s]."""
        order, amounts = self._fits(end, displacement, nuisance)
        best = int(order[0])
        return replace(self.law, signs=tuple(np.sign(self._axis(best, amounts, end) * amounts[best]).tolist()))

    def start(self, end: float, displacement: Array, nuisance: Array) -> tuple[Array, float]:
        """Return values and the sign of the axis, as `CouplingSearch.start`."""
        return self.starts(end, displacement, nuisance, 1)[0]

    def starts(self, end: float, displacement: Array, nuisance: Array, count: int) -> list[tuple[Array, float]]:
        """Return the best ``count`` distinct starts of the law's signs. Raises InputError where there is none."""
        order, amounts = self._fits(end, displacement, nuisance)
        found: list[tuple[Array, float]] = []
        shapes: list[Array] = []
        for k in order.tolist():
            if any(np.abs(np.log(self._shapes[k] / shape)).max() <= np.log(_APART) for shape in shapes):
                continue
            axis = self._axis(k, amounts, end)
            if self.law.signs and tuple(np.sign(axis * amounts[k]).tolist()) != self.law.signs:
                continue
            found.append((with_shape(self.law, np.abs(amounts[k]), self._shapes[k]), axis))
            shapes.append(self._shapes[k])
            if len(found) == count:
                break
        if not found:
            raise InputError("the displacement does not follow the voltage as the coupling's signs say")
        return found

    def _axis(self, candidate: int, amounts: Array, end: float) -> float:
        """Return the sign of the axis of a candidate with its row of gains ``amounts`` (m, k) up to ``end`` [s]."""
        return axis_of(amounts[candidate] @ self._waves[self._chosen[candidate]][:, self._t <= end])

    def _fits(self, end: float, displacement: Array, nuisance: Array) -> tuple[NDArray[np.intp], Array]:
        """Return the order of candidates, the best first and not all, and all gains (m, k) [m/V]."""
        part = self._t <= end
        data, extra, waves = displacement[self._keep][part], nuisance[self._keep][part], self._waves[:, part]
        # the rest and the drift are fitted along: what is left of all when they are taken out
        basis, _ = np.linalg.qr(extra)
        data = data - basis @ (basis.T @ data)
        left = waves - (waves @ basis) @ basis.T
        gram, moment = left @ left.T, left @ data
        size = np.sqrt(np.diag(gram))
        size[size == 0] = 1.0
        matrices = (gram / np.outer(size, size))[self._chosen[:, :, None], self._chosen[:, None, :]]
        matrices = matrices + 1e-10 * np.eye(matrices.shape[1])
        sides = (moment / size)[self._chosen]
        amounts = np.linalg.solve(matrices, sides[..., None])[..., 0]
        explained = (amounts * sides).sum(axis=1)
        amounts /= size[self._chosen]
        usable = np.isfinite(amounts).all(axis=1) & (amounts != 0).all(axis=1)
        if not usable.any():
            raise InputError("the displacement does not follow the voltage")
        order = np.argsort(np.where(usable, -explained, np.inf), kind="stable")[: int(usable.sum())]
        return order[:_MOST], amounts


def axis_of(curve: Array) -> float:
    """Return the sign of a displacement's axis: the largest excursion is towards the anode."""
    return float(np.sign(curve[np.argmax(np.abs(curve))])) or 1.0


def with_shape(law: MotionLaw, sizes: Array, shape: Array) -> Array:
    """Return the values of a law that relaxes: ``sizes`` of its gains, and ``shape``, all others."""
    values = np.empty(len(law.parameters))
    values[list(law.gains)] = sizes
    values[[k for k in range(len(values)) if k not in law.gains]] = shape
    return values


def search_of(
    law: MotionLaw, t: Array, drive: PiecewiseLinear, actuator: Actuator, ratio: float
) -> CouplingSearch | RelaxationSearch:
    """Return the search for starting values of a ``law`` at ``t`` [s]; ``ratio`` is 3 L_F^2/b^2."""
    return CouplingSearch(t, drive, ratio) if law.kind is None else RelaxationSearch(t, drive, actuator, law)
