"""The linear measurement model of the Kramers-Kronig check, and what it expects of every point from the others.

    Z(s) = R + s L + 1/(s C) + sum over k of R_k/(1 + s tau_k)

with any signs, on a fixed grid of tau_k that reaches beyond the band on both sides (Boukamp 1995), obeys the relations.
The amounts have a normal prior, whose width against the noise is the one of most evidence: with a dense grid and no
number of terms to choose, the model has no error of its own that could pass for a violation. The same form of 1/Z holds
for circuits with inductances in parallel.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Array, ComplexArray, Mask

#: Time constants a decade, decades beyond the band on either side, and the most of them.
_PER_DECADE, _BEYOND, _MOST = 8, 1.5, 200
#: R, L and C are freer than the relaxations by this factor.
_FREE = 30.0
#: Widths of the prior that are tried, relative to the strongest direction.
_WIDTHS = np.logspace(-12, 0, 37)
_LEAST_SIGMA = 1e-9


@dataclass(frozen=True, eq=False)
class MeasurementModel:
    """The model of relative numbers y/abs(y) of the points ``kept`` (f,).

    ``residuals`` (f,) are complex, of all points. ``deleted`` (f,) is what each point is away from what all other kept
    ones make expect, and ``surprise`` (f,) the same over its expected size, noise and extrapolation together, but for a
    factor that all points share. ``freedom`` is how many unknowns the data determine, ``terms`` the number of time
    constants, ``evidence`` -2 log(evidence).
    """

    residuals: ComplexArray
    deleted: ComplexArray
    surprise: Array
    kept: Mask
    freedom: float
    terms: int
    evidence: float


def measurement_model(omega: Array, y: ComplexArray, kept: Mask, rounding: float) -> MeasurementModel:
    """Return the measurement model of ``y`` (f,), impedances or admittances at ``omega`` (f,) [rad/s].

    ``rounding`` is the relative standard deviation below which no residual means anything.
    """
    columns, terms = _columns(omega, 1 / np.abs(y))
    target, rows = _parts(y / np.abs(y)), np.concatenate([kept, kept])
    matrix = np.concatenate([columns.real, columns.imag])
    matrix = matrix / np.linalg.norm(matrix[rows], axis=0)
    matrix[:, :3] *= _FREE
    left, strengths, right = np.linalg.svd(matrix[rows], full_matrices=False)
    amounts = left.T @ target[rows]
    width, evidence = _most_evident(strengths, amounts, target[rows] - left @ amounts, rounding)
    inverse = 1 / (strengths**2 + width**2)
    residuals = target - matrix @ (right.T @ (strengths * inverse * amounts))
    deleted, surprise = _deleted(matrix, right, inverse, width, residuals, kept)
    count = len(y)
    return MeasurementModel(
        residuals=residuals[:count] + 1j * residuals[count:],
        deleted=deleted,
        surprise=surprise,
        kept=kept,
        freedom=float(np.sum(strengths**2 * inverse)),
        terms=terms,
        evidence=evidence,
    )


def _columns(omega: Array, weight: Array) -> tuple[ComplexArray, int]:
    """Return the weighted columns (f, 3 + terms) of R, L, 1/C and the relaxations, and the number of these."""
    low, high = omega.min(), omega.max()
    terms = min(int(np.ceil(_PER_DECADE * (np.log10(high / low) + 2 * _BEYOND))) + 1, _MOST)
    tau = np.geomspace(10**-_BEYOND / high, 10**_BEYOND / low, terms)
    s = 1j * omega[:, None]
    columns = np.concatenate([np.ones_like(s), s / high, low / s, 1 / (1 + s * tau)], axis=1)
    return np.asarray(columns * weight[:, None], dtype=complex), terms


def _most_evident(strengths: Array, amounts: Array, rest: Array, rounding: float) -> tuple[float, float]:
    """Return the ratio of noise to prior of most evidence, and -2 log(evidence), the noise at its best."""
    widths = strengths[0] * _WIDTHS
    over = (strengths / widths[:, None]) ** 2
    squares = (amounts**2 / (1 + over)).sum(axis=1) + float(rest @ rest)
    readings = len(rest)
    variance = np.maximum(squares / readings, max(rounding, _LEAST_SIGMA) ** 2)
    evidence = squares / variance + readings * np.log(variance) + np.log1p(over).sum(axis=1)
    best = int(np.argmin(evidence))
    return float(widths[best]), float(evidence[best])


def _deleted(
    matrix: Array, right: Array, inverse: Array, width: float, residuals: Array, kept: Mask
) -> tuple[ComplexArray, Array]:
    """Return each point's distance from what the others make expect (f,), and the same over its expected size (f,)."""
    count = len(kept)
    felt = matrix @ right.T
    unfelt = np.maximum((matrix**2).sum(axis=1) - (felt**2).sum(axis=1), 0.0) / width**2
    re, im = felt[:count], felt[count:]
    spread = np.empty((count, 2, 2))
    spread[:, 0, 0] = (re**2) @ inverse + unfelt[:count]
    spread[:, 1, 1] = (im**2) @ inverse + unfelt[count:]
    spread[:, 0, 1] = spread[:, 1, 0] = (re * im) @ inverse
    one = np.eye(2)
    # of a kept point, which takes part in its own fit, the covariance of the deleted residual is (1 - H)^-1
    among = np.linalg.inv((1 + 1e-9) * one - np.where(kept[:, None, None], spread, 0.0))
    found = np.column_stack([residuals[:count], residuals[count:]])
    found = np.where(kept[:, None], np.einsum("kij,kj->ki", among, found), found)
    covariance = np.where(kept[:, None, None], among, one + spread)
    squares = np.einsum("ki,kij,kj->k", found, np.linalg.inv(covariance), found)
    return found[:, 0] + 1j * found[:, 1], np.sqrt(np.maximum(squares, 0.0) / 2)


def _parts(z: ComplexArray) -> Array:
    return np.concatenate([z.real, z.imag])
