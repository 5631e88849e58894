"""Estimates of a hyperelastic fit: parameters in the paper's convention, derived quantities, correlations."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from ..arrays import Array
from ..fit.estimate import Estimate, Interval
from ..fit.quantiles import student
from .fit import HyperelasticFit


def parameters(fit: HyperelasticFit) -> dict[str, Estimate]:
    """Return mu_i [Pa] and alpha_i in the paper's convention, with standard errors and 95 % intervals.

    If mu_i alpha_i > 0 was imposed, the interval of mu_i is symmetric in its logarithm and keeps the sign.
    """
    n, by = fit.terms, fit.to_parameters
    fixed = "" if fit.model == "ogden" else f"{fit.name} by definition"
    result = {}
    for i, (mu, alpha) in enumerate(zip(fit.material.mu, fit.material.alpha, strict=True)):
        result[f"mu_{i + 1}"] = _modulus(fit, mu, by[i])
        result[f"alpha_{i + 1}"] = (
            Estimate(alpha, "", fixed_because=fixed) if fixed else _estimate(fit, alpha, by[n + i], "")
        )
    return result


def derived(fit: HyperelasticFit) -> dict[str, Estimate]:
    """Return G, E = 3 G, each mu_i in the other convention; for Mooney-Rivlin and neo-Hookean also C10 and C01."""
    g, n = fit.material.shear_modulus, fit.terms
    every, each = np.repeat([1.0, 0.0], n), np.eye(2 * n)
    result = {"shear_modulus": _modulus(fit, g, every), "youngs_modulus": _modulus(fit, 3 * g, 3 * every)}
    for i, modulus in enumerate(fit.material.moduli):
        result[f"mu_{i + 1}_other_convention"] = _modulus(fit, modulus, each[i])
        if fit.model != "ogden":
            result[("c10", "c01")[i]] = _modulus(fit, modulus / 2, each[i] / 2)
    return result


def correlations(fit: HyperelasticFit) -> dict[str, float]:
    """Return the correlation of every pair of fitted parameters; empty if a combination is not determined."""
    names = [f"{kind}_{i + 1}" for kind in ("mu", "alpha") for i in range(fit.terms)][: fit.result.count]
    covariance = fit.parameter_covariance()[: fit.result.count, : fit.result.count]
    if np.isnan(covariance).any():
        return {}
    size = np.sqrt(np.diag(covariance))
    matrix = (covariance / np.outer(size, size)).tolist()
    return {f"{names[b]}, {names[a]}": matrix[b][a] for a in range(fit.result.count) for b in range(a)}


def _modulus(fit: HyperelasticFit, value: float, gradient: Array) -> Estimate:
    """Return the estimate of a modulus [Pa], whose interval keeps its sign if signs were imposed."""
    return _estimate(fit, value, gradient, "Pa", one_sign=fit.constrained)


def _estimate(fit: HyperelasticFit, value: float, gradient: Array, unit: str, one_sign: bool = False) -> Estimate:
    """Return a value with 95 % intervals by Student's t, for ``one_sign`` in its logarithm; none if undetermined.

    ``gradient`` (2 n,) is the value's gradient with respect to (g_1 .. g_n, alpha_1 .. alpha_n). If residuals are
    autocorrelated, errors that allow for it are given in addition to the covariance's, and are reported.
    """
    error = _error(gradient, fit.plain_covariance)
    if not math.isfinite(error):
        return Estimate(value, unit)
    plain = Estimate(value, unit, error, _interval(value, error, fit.samples - fit.result.count, one_sign))
    if fit.reported is None:
        return plain
    moved = gradient[: fit.result.count] != 0
    freedom = float(fit.reported.freedom[moved].min())
    wider = max(_error(gradient, fit.covariance), error)
    interval = _interval(value, wider, freedom, one_sign)
    return replace(plain, autoregression=wider, ci95_autoregression=interval, method="autoregression")


def _error(gradient: Array, covariance: Array) -> float:
    return float(np.sqrt(gradient @ covariance @ gradient))


def _interval(value: float, error: float, freedom: float, one_sign: bool) -> Interval:
    half = float(student(0.975, freedom)) * error
    if not one_sign:
        return value - half, value + half
    factor = math.exp(min(half / abs(value), 300.0))
    low, high = sorted((value / factor, value * factor))
    return low, high
