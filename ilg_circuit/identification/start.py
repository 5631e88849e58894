"""Computes starting values from the data: poles from a grid, all other constants by linear least squares.

For given poles, current and displacement are linear in the remaining constants; their building blocks are first and
second order filters of the drive, for a whole grid of poles at once.
"""

from __future__ import annotations

from contextlib import suppress
from copy import copy
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array
from ..drive import PiecewiseLinear
from ..errors import InputError
from ..extras import whole
from ..measurements.voltage import simplified
from ..solve.waves import mode_waves
from ..strip.models import ElectricalModel
from .modal import second_order_waves

_MOST_SAMPLES = 500
_RATES = 40
_DAMPINGS = (0.15, 0.3, 0.5, 0.7, 1.0, 1.5, 2.5, 4.0, 8.0, 16.0)
_FREQUENCIES = 24
#: Ratio of damping ratios or natural frequencies above which two starts of d(s) are distinct.
_APART = 1.8
#: Relative residual below which two basis functions are linearly dependent.
_ALIKE = 1e-12
#: The same, of several columns of a linear fit.
_DEPENDENT = 1e-10
#: Least starting value of the steady conductance, relative to the peak's.
_LEAST_STEADY = 1e-2
#: Tolerance of the drive for starting values, as a fraction of its range.
_COARSE = 0.01


def current_start(
    t: Array,
    current: Array,
    drive: PiecewiseLinear,
    electrode_resistance: float,
    branches: int,
    nuisance: Array | None = None,
) -> tuple[float, list[tuple[float, float]]]:
    """Return (Rdc, [(R, C), ...] by ascending time constant) for samples at ``t`` >= 0 [s] without offset.

    ``nuisance`` (samples, q) are linear terms beside the model. The current at the port is g0 u + sum of g_k times a
    high-pass of u; rates from a grid, g by least squares.
    """
    keep = thinned(t)
    t, current = t[keep], current[keep]
    beside = np.linalg.qr(nuisance[keep])[0] if nuisance is not None else np.zeros((len(t), 0))
    drive = _coarse(drive)
    rates, basis = linear_basis(t, drive)
    every = range(1, len(rates) + 1, 1 if branches < 3 else 2)
    choices = np.array([(0, *chosen) for chosen in combinations(every, branches)])
    amounts, left = _linear_fits(basis.T, choices, current, beside)
    left[(amounts[:, 1:] <= 0).any(axis=1)] = np.inf
    best = int(np.argmin(left))
    if not np.isfinite(left[best]):
        raise InputError("the current does not follow the voltage as a resistive and capacitive strip's does")
    choice = amounts[best], rates[choices[best, 1:] - 1]
    g, chosen_rates = _refined(t, current, drive, choice[1], beside) or choice
    peak = float(np.abs(g[0]) + g[1:].sum())
    g[0] = max(g[0], _LEAST_STEADY * peak)
    dc = max(1 / g[0] - electrode_resistance, 1e-3 / g[0])
    # the terminal's conductances are converted into branches after subtracting Re
    share = max(1 - electrode_resistance * float(g.sum()), 0.05)
    pairs = [(share / gk, gk / rate / share) for gk, rate in zip(g[1:], chosen_rates, strict=True)]
    return dc, sorted(pairs, key=lambda pair: pair[0] * pair[1])


def _refined(
    t: Array, current: Array, drive: PiecewiseLinear, rates: Array, beside: Array
) -> tuple[Array, Array] | None:
    """Return conductances and rates after a simplex search from the best grid point; None if they are not physical.

    Under waveforms of both signs the coarse grid alone can make the steady conductance negative.
    """
    with whole():
        from scipy.optimize import minimize

    u = drive.value(t)

    def solved(logs: Array) -> tuple[Array, float]:
        return _linear_fit(np.vstack([u, _high_passes(np.exp(logs), drive, t)]).T, current, beside)

    found = minimize(lambda logs: solved(logs)[1], np.log(rates), method="Nelder-Mead", options={"maxiter": 100})
    g, _ = solved(found.x)
    return (g, np.exp(found.x)) if (g > 0).all() else None


class FewerRelaxations(InputError):
    """A current shows fewer relaxations than a model has."""


def model_start(
    model: ElectricalModel,
    t: Array,
    current: Array,
    drive: PiecewiseLinear,
    electrode_resistance: float,
    nuisance: Array | None = None,
) -> Array:
    """Return starting values (n,) of ``model``'s parameters in their order; arguments as for `current_start`.

    If the record shows fewer relaxations than the model looks for at first, fewer may be enough. Raises
    FewerRelaxations if it shows fewer than that, InputError if it shows none.
    """
    *counts, last = model.ions.branch_counts

    def start(count: int) -> Array:
        found = current_start(t, current, drive, electrode_resistance, count, nuisance)
        return model.starts_from_branches(*found, drive.largest())

    for count in counts:
        with suppress(InputError):
            return start(count)
    try:
        return start(last)
    except InputError:
        for fewer in range(last - 1, 0, -1):
            with suppress(InputError):
                current_start(t, current, drive, electrode_resistance, fewer, nuisance)
                break
        else:
            raise
    shown = f"{fewer} relaxation{'s' * (fewer > 1)}"
    raise FewerRelaxations(f"the current shows {shown}, and model {model.name} has {last}: take a simpler one")


class CouplingSearch:
    """Starting values of d(s) for a record, with basis functions that are computed once for all windows.

    ``t`` [s] since the onset (negative: at rest); ``ratio`` = 3 L_F^2/b^2.
    """

    def __init__(self, t: Array, drive: PiecewiseLinear, ratio: float) -> None:
        self._keep = thinned(t)
        self._ratio = ratio
        self._t = t[self._keep]
        self._after = self._t >= 0
        frequencies = _rate_grid(self._t[self._after], _FREQUENCIES)
        self._grid = [(zeta, float(wn)) for zeta in _DAMPINGS for wn in frequencies]
        zeta, wn = np.array(self._grid).T
        simple, later = _coarse(drive), self._t[self._after]
        self._waves = second_order_waves(zeta, wn, lambda poles: mode_waves(poles, simple, later))

    def start(self, end: float, displacement: Array, nuisance: Array) -> tuple[Array, float]:
        """Return ((Kd, Zd, zeta', wn'), sign) of samples up to ``end`` [s]; sign -1: it falls as the voltage rises.

        ``displacement`` (samples,) and linear ``nuisance`` (samples, k) cover the whole record. Raises
        InputError if the displacement does not respond to the voltage.
        """
        return self.starts(end, displacement, nuisance, 1)[0]

    def at(self, t: Array) -> CouplingSearch:
        """Return the search for other times [s] within these, by interpolation of its basis functions."""
        found = copy(self)
        found._keep, found._t, found._after = np.arange(len(t)), t, t >= 0
        grid, later = self._t[self._after], t[t >= 0]
        right = np.clip(np.searchsorted(grid, later), 1, len(grid) - 1)
        share = np.clip((later - grid[right - 1]) / (grid[right] - grid[right - 1]), 0.0, 1.0)
        found._waves = (1 - share) * self._waves[:, :, right - 1] + share * self._waves[:, :, right]
        return found

    def gain(self, displacement: Array, nuisance: Array) -> float:
        """Return the sum of squares of the displacement (samples,) that the best start explains beyond linear terms."""
        amounts, gained = self._terms(np.inf, displacement, nuisance)
        allowed = amounts[:, 0] * amounts[:, 1] > 0
        return float(gained.max(initial=0.0, where=allowed))

    def starts(self, end: float, displacement: Array, nuisance: Array, count: int) -> list[tuple[Array, float]]:
        """Return the best ``count`` distinct starts, as `start`, the best one first."""
        amounts, gained = self._terms(end, displacement, nuisance)
        # y = k d0 [x1 + (wn/Zd) x2]: both amounts of one sign
        allowed = np.flatnonzero((amounts[:, 0] * amounts[:, 1] > 0) & (gained > 0))
        if not len(allowed):
            raise InputError("the displacement does not follow the voltage as the coupling d(s) does")
        chosen: list[tuple[float, float]] = []
        starts: list[tuple[Array, float]] = []
        for k in allowed[np.argsort(-gained[allowed], kind="stable")].tolist():
            if len(starts) == count:
                break
            (low, high), (zeta, wn) = amounts[k].tolist(), self._grid[k]
            if all(max(zeta / z, z / zeta) > _APART or max(wn / w, w / wn) > _APART for z, w in chosen):
                chosen.append((zeta, wn))
                zero = wn * low / high
                starts.append((np.array([abs(low) / self._ratio * wn**2 / zero, zero, zeta, wn]), float(np.sign(low))))
        return starts

    def _terms(self, end: float, displacement: Array, nuisance: Array) -> tuple[Array, Array]:
        """Return the coefficients (grid, 2) for samples up to ``end`` [s], and the squares explained (grid,)."""
        part = self._t <= end
        data, extra, after = displacement[self._keep][part], nuisance[self._keep][part], self._after[part]
        basis = np.zeros((len(self._grid), 2, len(data)))
        basis[:, :, after] = self._waves[:, :, : after.sum()]
        terms = np.linalg.qr(extra)[0]
        return _two_terms(basis - (basis @ terms) @ terms.T, data - terms @ (terms.T @ data))


def _two_terms(basis: Array, data: Array) -> tuple[Array, Array]:
    """Return least-squares coefficients (n, 2) of ``data`` (m,) for ``basis`` (n, 2, m), and squares explained (n,).

    Coefficients are zero where the two basis functions are linearly dependent.
    """
    size = np.linalg.norm(basis, axis=2)
    size[size == 0] = 1.0
    along = (basis @ data) / size
    cosine = np.einsum("nm,nm->n", basis[:, 0], basis[:, 1]) / size.prod(axis=1)
    apart = 1 - cosine**2
    found = (along - cosine[:, None] * along[:, ::-1]) / np.where(apart > _ALIKE, apart, np.inf)[:, None]
    return found / size, (found * along).sum(axis=1)


def _coarse(drive: PiecewiseLinear) -> PiecewiseLinear:
    """Return a drive with few knots that approximates a measured one with many."""
    if len(drive.times) < 50:
        return drive
    kept = simplified(drive.times, drive.values, _COARSE * float(np.ptp(drive.values)))
    return PiecewiseLinear(drive.times[kept], drive.values[kept])


def thinned(t: Array, most: int = _MOST_SAMPLES) -> NDArray[np.intp]:
    """Return at most ``most`` indices of samples, dense at fast transients: half of them even, half logarithmic."""
    if len(t) <= most:
        return np.arange(len(t))
    first = int(np.searchsorted(t, 0.0))
    even = np.linspace(0, len(t) - 1, most // 2).round()
    fast = first + np.geomspace(1, len(t) - first, most // 2).round() - 1
    return np.unique(np.concatenate([even, fast]).astype(np.intp))


def _rate_grid(t: Array, count: int) -> Array:
    """Return the rates [1/s] from below the record's length to its sampling interval."""
    positive = t[t > 0]
    shortest = max(float(np.diff(t).min()), float(positive[-1]) * 1e-5)
    return np.geomspace(0.3 / float(positive[-1]), 1.0 / shortest, count)


def linear_basis(t: Array, drive: PiecewiseLinear) -> tuple[Array, Array]:
    """Return rates [1/s] (n,), and the drive with its high-passes of these (n + 1, samples) at ``t`` >= 0 [s]."""
    rates = _rate_grid(t, _RATES)
    return rates, np.vstack([drive.value(t), _high_passes(rates, drive, t)])


def _high_passes(rates: Array, drive: PiecewiseLinear, t: Array) -> Array:
    """Return s/(s + rate) of a drive at ``t`` [s] (samples,) for ``rates`` [1/s] (n,); shape (n, samples)."""
    return np.asarray(drive.value(t) - rates[:, None] * mode_waves(-rates, drive, t))


def _linear_fits(basis: Array, choices: NDArray[np.intp], data: Array, beside: Array) -> tuple[Array, Array]:
    """Return `_linear_fit` of each of the ``choices`` (c, k) of columns of ``basis`` (m, n): (c, k) and (c,).

    The sum of squares is infinite where the columns are linearly dependent.
    """
    basis, data = _without(basis, beside), _without(data, beside)
    upper = np.asarray(np.linalg.qr(np.column_stack([basis, data]), mode="r"))  # the factor of all choices
    columns = upper[:, choices].transpose(1, 0, 2)
    size = np.linalg.norm(columns, axis=1)
    size[size == 0] = 1.0
    q, r = np.linalg.qr(columns / size[:, None])
    apart = np.abs(np.diagonal(r, axis1=1, axis2=2)).min(axis=1) > _DEPENDENT
    r[~apart] = np.eye(r.shape[1])
    along = q.swapaxes(1, 2) @ upper[:, -1]
    found = np.linalg.solve(r, along[..., None])[..., 0] / size
    left = ((np.einsum("cmk,ck->cm", columns, found) - upper[:, -1]) ** 2).sum(axis=1)
    return found, np.where(apart, left, np.inf)


def _without(rows: Array, beside: Array) -> Array:
    """Return ``rows`` (samples, ...) without their parts along orthonormal terms ``beside`` (samples, q)."""
    return rows - beside @ (beside.T @ rows) if beside.shape[1] else rows


def _linear_fit(basis: Array, data: Array, beside: Array) -> tuple[Array, float]:
    """Return coefficients and the residual sum of squares, beside orthonormal linear terms ``beside`` (samples, q)."""
    basis, data = _without(basis, beside), _without(data, beside)
    found: Array = np.asarray(np.linalg.lstsq(basis, data, rcond=_DEPENDENT)[0], dtype=np.float64)
    return found, float(((basis @ found - data) ** 2).sum())
