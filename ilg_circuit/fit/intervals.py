"""95 % intervals of a fit's parameters, by the method that the user asks for, and what became of it.

``covariance`` is the default: from the slopes at the fit, by a block bootstrap where neighbouring residuals are alike.
``bootstrap`` is that bootstrap whatever the residuals, ``profile`` the profile likelihood, which falls back to the
bootstrap parameter by parameter where it fails, ``mcmc`` the posterior's quantiles.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, get_args

from ..errors import InputError
from .bootstrap import Bootstrap, block_bootstrap, correlated, widening
from .estimate import Method, Parameter
from .least_squares import Fit
from .mcmc import sample
from .profile import REACH, profile


@dataclass(frozen=True)
class Uncertainties:
    """The parameters of one fit with their intervals, what to warn of, and ``details`` for the statistics."""

    parameters: dict[str, Parameter]
    warnings: tuple[str, ...] = ()
    details: dict[str, Any] | None = None


def require_method(method: str) -> Method:
    """The method of that name. Raises InputError that lists them."""
    methods: tuple[Method, ...] = get_args(Method)
    for known in methods:
        if method == known:
            return known
    raise InputError(f"intervals are '{method}'; choose one of {', '.join(get_args(Method))}")


def uncertainties(
    fit: Fit, units: dict[str, str], method: Method = "covariance", progress: Callable[[], None] | None = None
) -> Uncertainties:
    """Parameters of ``fit`` with ``units`` and intervals by ``method``. Raises InputError where emcee is missing."""
    alike = correlated(fit)
    blocks = block_bootstrap(fit) if alike or method == "bootstrap" else None
    plain = {
        name: Parameter(value, units[name], error, (low, high))
        for name, value, error, (low, high) in zip(
            fit.names, fit.values.tolist(), fit.errors.tolist(), fit.intervals.tolist(), strict=True
        )
    }
    if blocks is not None:
        plain = _with_bootstrap(plain, blocks)
    if method == "profile":
        return _profiled(fit, plain, blocks, progress)
    if method == "mcmc":
        return _sampled(fit, plain, progress)
    return Uncertainties(plain)


def _with_bootstrap(parameters: dict[str, Parameter], blocks: Bootstrap, note: str = "") -> dict[str, Parameter]:
    return {
        name: replace(p, bootstrap=error, ci95_bootstrap=(low, high), method="bootstrap", note=note)
        for (name, p), error, (low, high) in zip(
            parameters.items(), blocks.errors.tolist(), blocks.intervals.tolist(), strict=True
        )
    }


def _profiled(
    fit: Fit, plain: dict[str, Parameter], blocks: Bootstrap | None, progress: Callable[[], None] | None
) -> Uncertainties:
    found = dict(zip(fit.names, profile(fit, widening(fit), progress), strict=True))
    result, warnings = {}, []
    fallback = plain
    if blocks is None and any(p.failure for p in found.values()):
        fallback = _with_bootstrap(plain, block_bootstrap(fit))
    for name, p in found.items():
        if p.failure:
            result[name] = replace(fallback[name], note=f"{p.failure}; a bootstrap's instead")
            warnings.append(f"no profile of {name} ({p.failure}): its interval is a bootstrap's")
            continue
        sides = [side for side, missing in (("lower", p.open_below), ("upper", p.open_above)) if missing]
        note = f"no {' and no '.join(sides)} limit within a factor of {REACH:.0e}" if sides else ""
        result[name] = replace(plain[name], ci95_profile=(p.low, p.high), method="profile", note=note)
        if sides:
            warnings.append(f"the data set {name} {note}")
    details = {"method": "profile", "failed": [name for name, p in found.items() if p.failure]}
    return Uncertainties(result, tuple(warnings), details)


def _sampled(fit: Fit, plain: dict[str, Parameter], progress: Callable[[], None] | None) -> Uncertainties:
    chain = sample(fit, widening(fit), progress)
    result = {
        name: replace(p, ci95_mcmc=(low, high), method="mcmc")
        for (name, p), (low, high) in zip(plain.items(), chain.intervals.tolist(), strict=True)
    }
    warnings = [] if chain.converged else [f"the Markov chain is short ({chain.told}): its intervals are rough"]
    details = {
        "method": "mcmc",
        "walkers": chain.walkers,
        "steps": chain.steps,
        "autocorrelation_steps": chain.autocorrelation,
        "acceptance": chain.acceptance,
        "converged": chain.converged,
    }
    return Uncertainties(result, tuple(warnings), details)
