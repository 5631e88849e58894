"""Estimates of a hyperelastic fit: parameters in the paper's convention, derived quantities, correlations."""

from __future__ import annotations

import math

import numpy as np

from ..fit.estimate import Estimate
from .fit import HyperelasticFit


def parameters(fit: HyperelasticFit) -> dict[str, Estimate]:
    """Return mu_i [Pa] and alpha_i in the paper's convention, with standard errors and 95 % intervals.

    Where mu_i alpha_i > 0 was imposed, the interval of mu_i is symmetric about its logarithm: it keeps the sign.
    """
    n, errors = fit.terms, np.sqrt(np.diag(fit.parameter_covariance())).tolist()
    fixed = "" if fit.model == "ogden" else f"{fit.name} by definition"
    result = {}
    for i, (mu, alpha) in enumerate(zip(fit.material.mu, fit.material.alpha, strict=True)):
        result[f"mu_{i + 1}"] = _modulus(fit, mu, errors[i])
        result[f"alpha_{i + 1}"] = (
            Estimate(alpha, "", fixed_because=fixed) if fixed else _estimate(fit, alpha, errors[n + i], "")
        )
    return result


def derived(fit: HyperelasticFit) -> dict[str, Estimate]:
    """Return G, E = 3 G, each mu_i in the other convention; for Mooney-Rivlin and neo-Hookean also C10 and C01."""
    g, error = fit.material.shear_modulus, fit.modulus_error
    result = {"shear_modulus": _modulus(fit, g, error), "youngs_modulus": _modulus(fit, 3 * g, 3 * error)}
    errors = np.sqrt(np.diag(fit.covariance)).tolist()
    for i, modulus in enumerate(fit.material.moduli):
        result[f"mu_{i + 1}_other_convention"] = _modulus(fit, modulus, errors[i])
        if fit.model != "ogden":
            result[("c10", "c01")[i]] = _modulus(fit, modulus / 2, errors[i] / 2)
    return result


def correlations(fit: HyperelasticFit) -> dict[str, float]:
    """Return the correlation of every pair of fitted parameters; none where a combination is not determined."""
    names = [f"{kind}_{i + 1}" for kind in ("mu", "alpha") for i in range(fit.terms)][: fit.result.count]
    covariance = fit.parameter_covariance()[: fit.result.count, : fit.result.count]
    if np.isnan(covariance).any():
        return {}
    size = np.sqrt(np.diag(covariance))
    matrix = (covariance / np.outer(size, size)).tolist()
    return {f"{names[b]}, {names[a]}": matrix[b][a] for a in range(fit.result.count) for b in range(a)}


def _modulus(fit: HyperelasticFit, value: float, error: float) -> Estimate:
    """Return a modulus [Pa], whose interval keeps its sign where signs were imposed."""
    return _estimate(fit, value, error, "Pa", one_sign=fit.constrained)


def _estimate(fit: HyperelasticFit, value: float, error: float, unit: str, one_sign: bool = False) -> Estimate:
    """Return a value with its 95 % interval by Student's t, ``one_sign``: of its logarithm; bare if undetermined."""
    from scipy.stats import t as student

    if not math.isfinite(error):
        return Estimate(value, unit)
    half = float(student.ppf(0.975, fit.samples - fit.result.count)) * error
    if not one_sign:
        return Estimate(value, unit, error, (value - half, value + half))
    factor = math.exp(min(half / abs(value), 300.0))
    low, high = sorted((value / factor, value * factor))
    return Estimate(value, unit, error, (low, high))
