"""Computes 95 % intervals of a fit's parameters by the chosen method.

``covariance`` is the default: from the slopes at the fit, or by ``autoregression`` if residuals are autocorrelated.
``autoregression`` allows for autocorrelation in any case (see `fit.reported`), ``bootstrap`` is a block bootstrap.
``profile`` is the profile likelihood; for a parameter where it fails, the autoregression is used if residuals are
autocorrelated, else the bootstrap. ``mcmc`` are the posterior's quantiles. Where the misfit is no parabola up to the
ends of the default's interval, slopes at the fit do not tell them: those of cheap problems are the profile's.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, get_args

import numpy as np

from ..arrays import Array, Mask
from ..errors import IlgError, wrong_choice
from ..findings import Finding
from .bootstrap import Bootstrap, block_bootstrap
from .estimate import Estimate, Method
from .limits import LOG_REACH, gain_at_limits, limits
from .mcmc import sample
from .problem import Problem, Progress
from .profile import REACH, profile
from .reported import Reported, widened, widening, with_autocorrelation
from .result import FitResult

#: Relative difference of the misfit's root at an interval's end from a parabola's above which a profile is computed.
_BENT = 0.15
#: Places of the others at which the least misfit there is sought.
_PLACES = 3
#: Residuals that are rounding, relative to the data.
_EXACT = 1e-9


@dataclass(frozen=True)
class Uncertainties:
    """The estimates of one fit by label, findings, and ``details`` of the method by component.

    ``ends`` are by label the coordinates (2, n) of all values at the ends of profiles that took the place of intervals
    by slopes.
    """

    estimates: dict[str, Estimate]
    findings: tuple[Finding, ...] = ()
    details: tuple[Mapping[str, Any], ...] = ()
    ends: Mapping[str, Array] = field(default_factory=dict)


def require_method(method: str) -> Method:
    """Return the method of that name. Raises InputError, which lists the methods, for another name."""
    methods: tuple[Method, ...] = get_args(Method)
    for known in methods:
        if method == known:
            return known
    raise wrong_choice("intervals", method, get_args(Method))


def uncertainties(
    fit: FitResult, method: Method = "covariance", progress: Progress = None, *, cheap: Collection[str] = ()
) -> Uncertainties:
    """Return the estimates of ``fit`` with intervals by ``method``, component by component.

    By the default, those of labels that are ``cheap`` to profile are profiles if the misfit is no parabola up to their
    ends. Raises InputError if emcee is missing.
    """
    parts = [_of_component(part, method, progress) for part in fit.parts]
    if method == "covariance" and cheap:
        parts = [_bent_profiled(part, own, cheap, progress) for part, own in zip(fit.parts, parts, strict=True)]
    every = {label: estimate for part in parts for label, estimate in part.estimates.items()}
    return Uncertainties(
        {label: every[label] for label in fit.labels},
        tuple(finding for part in parts for finding in part.findings),
        tuple(details for part in parts for details in part.details),
        {
            label: _among(fit, own, x)
            for own, part in zip(fit.parts, parts, strict=True)
            for label, x in part.ends.items()
        },
    )


def _among(fit: FitResult, part: FitResult, ends: Array) -> Array:
    """Return coordinates (2, n) of all values with those of a ``part`` at the ends (2, k)."""
    x = np.tile(fit.coordinates, (2, 1))
    x[:, [fit.labels.index(label) for label in part.labels]] = ends
    return x


def _of_component(fit: FitResult, method: Method, progress: Progress) -> Uncertainties:
    noise = with_autocorrelation(fit) if method == "autoregression" or widened(fit) else None
    rows = zip(
        fit.labels, fit.problem.moved, fit.values.tolist(), fit.errors.tolist(), fit.intervals.tolist(), strict=True
    )
    plain = {label: Estimate(value, p.unit, error, (low, high)) for label, p, value, error, (low, high) in rows}
    if method == "bootstrap" or noise is not None:
        plain = _with_bootstrap(plain, noise.blocks if noise is not None else block_bootstrap(fit))
    if noise is not None and method != "bootstrap":
        plain = _with_autoregression(plain, noise)
    if method == "profile":
        return _profiled(fit, plain, progress)
    if method == "mcmc":
        return _sampled(fit, plain, progress)
    return Uncertainties(plain)


def _bent_profiled(fit: FitResult, found: Uncertainties, labels: Collection[str], progress: Progress) -> Uncertainties:
    """Return estimates with profiles for those of ``labels`` to whose ends the misfit is no parabola.

    A profile followed along one valley may miss another one: it holds what the others' ends hold of its value. Exact
    data have none, since their misfit is rounding.
    """
    n, size = len(fit.values), float(np.linalg.norm(fit.problem.data))
    if not np.linalg.norm(fit.residuals) > _EXACT * size:
        return found
    slopes = fit.problem.projected((fit.slopes[:, :n] * fit.units).T).T
    factors, ends = widening(fit).tolist(), {}
    for k, label in enumerate(fit.labels):
        if label in labels and _bent(fit, k, factors[k], slopes):
            ends[label] = limits(fit, k, factors[k])
            if progress:
                progress()
    estimates, every = dict(found.estimates), np.array([own.coordinates for own in ends.values()])
    for label, own in ends.items():
        k = fit.labels.index(label)
        low, high = _held_at(fit, k, every[:, :, k])
        estimates[label] = replace(
            estimates[label], ci95_profile=(min(own.low, low), max(own.high, high)), method="profile"
        )
    return replace(found, estimates=estimates, ends={label: own.coordinates for label, own in ends.items()})


def _held_at(fit: FitResult, k: int, coordinates: Array) -> tuple[float, float]:
    """Return the least and the largest of the ``coordinates`` of value ``k`` as values; far from the fit its limits."""
    middle, found = fit.coordinates[k], []
    for x, far in ((coordinates.min(), -np.inf), (coordinates.max(), np.inf)):
        at = fit.coordinates.copy()
        at[k] = x if abs(x - middle) < LOG_REACH else far
        found.append(float(fit.problem.scales.values(at)[k]))
    return found[0], found[1]


def _bent(fit: FitResult, k: int, widening: float, slopes: Array) -> bool:
    """Return True if the misfit is no parabola up to the ends of an interval of value ``k`` by slopes.

    The others go with it along a line, and then by steps with the ``slopes`` (samples, n) by the coordinates.
    """
    x, gain, n = fit.coordinates, gain_at_limits(fit, widening), len(fit.values)
    half = np.sqrt(gain / fit.sum_of_squares * fit.degrees_of_freedom) * fit.pooled_errors[k] / fit.units[k]
    along = fit.covariance[:n, k] / fit.units * (half * fit.units[k] / fit.covariance[k, k])
    others = np.arange(n) != k
    basis, triangle = np.linalg.qr(slopes[:, others])
    for start in (x - along, x + along):
        try:
            with np.errstate(all="ignore"):  # far from the fit, where it tells that as well
                growth = _least_near(fit.problem, start, others, basis, triangle) - fit.sum_of_squares
        except (IlgError, np.linalg.LinAlgError):
            return True
        if not abs(np.sqrt(max(growth, 0.0) / gain) - 1) <= _BENT:
            return True
    return False


def _least_near(problem: Problem, x: Array, moved: Mask, basis: Array, triangle: Array) -> float:
    """Return the least sum of squares near coordinates ``x`` (n,) at few places, after steps of those ``moved`` (n,).

    The steps are by slopes whose QR factors are ``basis`` (samples, n - 1) and ``triangle``.
    """
    x, least = x.copy(), np.inf
    for _ in range(_PLACES):
        residuals = problem.projected(problem.data - problem.predictions(x[None])[0])
        least = min(least, float(residuals @ residuals))
        x[moved] += np.linalg.solve(triangle, basis.T @ residuals)
    return least


def _with_autoregression(estimates: dict[str, Estimate], noise: Reported) -> dict[str, Estimate]:
    rows = zip(estimates.items(), noise.errors.tolist(), noise.intervals.tolist(), strict=True)
    return {
        label: replace(e, autoregression=error, ci95_autoregression=(low, high), method="autoregression")
        for (label, e), error, (low, high) in rows
    }


def _with_bootstrap(estimates: dict[str, Estimate], blocks: Bootstrap) -> dict[str, Estimate]:
    rows = zip(estimates.items(), blocks.errors.tolist(), blocks.intervals.tolist(), strict=True)
    return {
        label: replace(e, bootstrap=error, ci95_bootstrap=(low, high), method="bootstrap")
        for (label, e), error, (low, high) in rows
    }


def _profiled(fit: FitResult, plain: dict[str, Estimate], progress: Progress) -> Uncertainties:
    found = dict(zip(fit.labels, profile(fit, widening(fit), progress), strict=True))
    result, findings = {}, []
    fallback = plain
    if any(p.failure and plain[label].autoregression is None for label, p in found.items()):
        fallback = _with_bootstrap(plain, block_bootstrap(fit))
    for label, p in found.items():
        if p.failure:
            instead = fallback[label].method
            result[label] = replace(fallback[label], note=f"{p.failure}; by {instead} instead")
            failed = {"parameter": label, "reason": p.failure, "instead": instead}
            findings.append(Finding("profile-failed", values=failed))
            continue
        sides = [side for side, missing in (("lower", p.open_below), ("upper", p.open_above)) if missing]
        note = f"no {' and no '.join(sides)} limit within a factor of {REACH:.0e}" if sides else ""
        result[label] = replace(plain[label], ci95_profile=(p.low, p.high), method="profile", note=note)
        if sides:
            values = {"parameter": label, "sides": " and no ".join(sides), "reach": REACH}
            findings.append(Finding("profile-open", values=values))
    details = {"method": "profile", "failed": [label for label, p in found.items() if p.failure]}
    return Uncertainties(result, tuple(findings), (details,))


def _sampled(fit: FitResult, plain: dict[str, Estimate], progress: Progress) -> Uncertainties:
    chain = sample(fit, widening(fit), progress)
    result = {
        label: replace(e, ci95_mcmc=(low, high), method="mcmc")
        for (label, e), (low, high) in zip(plain.items(), chain.intervals.tolist(), strict=True)
    }
    findings = () if chain.converged else (Finding("chain-short", values={"chain": chain.length}),)
    details = {
        "method": "mcmc",
        "walkers": chain.walkers,
        "steps": chain.steps,
        "autocorrelation_steps": chain.autocorrelation,
        "acceptance": chain.acceptance,
        "converged": chain.converged,
    }
    return Uncertainties(result, findings, (details,))
