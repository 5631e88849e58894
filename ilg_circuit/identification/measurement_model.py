"""Fits the linear measurement model of the Kramers-Kronig check, and predicts every point from the others.

    Z(s) = R + s L + 1/(s C) + sum over k of R_k/(1 + s tau_k)

with coefficients of any sign, on a fixed grid of tau_k that extends beyond the band on both sides (Boukamp 1995),
satisfies the relations. The coefficients have a normal prior, whose width relative to the noise maximises the evidence.
With a dense grid and no choice of the number of terms, the model error cannot be mistaken for a violation. The same
form of 1/Z holds for circuits with inductances in parallel.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Array, ComplexArray, Mask

#: Time constants per decade, decades beyond the band on either side, largest number of time constants.
_PER_DECADE, _BEYOND, _MOST = 8, 1.5, 200
#: Factor by which the prior of R, L and C is wider than for the relaxations.
_FREE = 30.0
#: Widths of the prior that are tried, relative to the strongest direction.
_WIDTHS = np.logspace(-12, 0, 37)
_LEAST_SIGMA = 1e-9


@dataclass(frozen=True, eq=False)
class MeasurementModel:
    """The model of relative numbers y/abs(y) of the points ``kept`` (f,).

    ``residuals`` (f,) are complex, for all points. ``deleted`` (f,) is the deviation of each point from its prediction
    by the other kept points (deleted residual), and ``surprise`` (f,) the same over its standard deviation, of noise
    and prediction together, up to a factor common to all points. ``freedom`` is the effective number of parameters,
    ``terms`` the number of time constants, ``evidence`` is -2 log(evidence).
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

    ``rounding`` is the relative standard deviation of rounding, below which residuals are meaningless.
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
    """Return the weighted columns (f, 3 + terms) of R, L, 1/C and the relaxations, and the number of relaxations."""
    low, high = omega.min(), omega.max()
    terms = min(int(np.ceil(_PER_DECADE * (np.log10(high / low) + 2 * _BEYOND))) + 1, _MOST)
    tau = np.geomspace(10**-_BEYOND / high, 10**_BEYOND / low, terms)
    s = 1j * omega[:, None]
    columns = np.concatenate([np.ones_like(s), s / high, low / s, 1 / (1 + s * tau)], axis=1)
    return np.asarray(columns * weight[:, None], dtype=complex), terms


def _most_evident(strengths: Array, amounts: Array, rest: Array, rounding: float) -> tuple[float, float]:
    """Return the ratio of noise to prior that maximises the evidence, and -2 log(evidence) with the noise maximised."""
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
    """Return each point's deleted residual (f,), and the same over its standard deviation (f,)."""
    count = len(kept)
    felt = matrix @ right.T
    unfelt = np.maximum((matrix**2).sum(axis=1) - (felt**2).sum(axis=1), 0.0) / width**2
    re, im = felt[:count], felt[count:]
    spread = np.empty((count, 2, 2))
    spread[:, 0, 0] = (re**2) @ inverse + unfelt[:count]
    spread[:, 1, 1] = (im**2) @ inverse + unfelt[count:]
    spread[:, 0, 1] = spread[:, 1, 0] = (re * im) @ inverse
    one = np.eye(2)
    # for a kept point, which influences its own fit, the covariance of the deleted residual is (1 - H)^-1
    among = np.linalg.inv((1 + 1e-9) * one - np.where(kept[:, None, None], spread, 0.0))
    found = np.column_stack([residuals[:count], residuals[count:]])
    found = np.where(kept[:, None], np.einsum("kij,kj->ki", among, found), found)
    covariance = np.where(kept[:, None, None], among, one + spread)
    squares = np.einsum("ki,kij,kj->k", found, np.linalg.inv(covariance), found)
    return found[:, 0] + 1j * found[:, 1], np.sqrt(np.maximum(squares, 0.0) / 2)


def _parts(z: ComplexArray) -> Array:
    return np.concatenate([z.real, z.imag])
