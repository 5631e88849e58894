"""Uncertainty of a design: the covariance of its strip's fit, propagated to every required quantity; Sobol indices.

Standard errors are first-order; probabilities are counted over strips drawn from the covariance. A reserve can be
added to each requirement, so that it is met with a stated confidence. Sobol indices, by SALib, are the share of each
quantity's variance over the ranges that each parameter causes.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Array
from ..errors import IlgError, InputError
from ..extras import require_sensitivity
from ..result import Column
from ..simulation.prediction_band import scaled
from ..simulation.response import sample_times, transient_band
from ..strip.actuator import Uncertainty
from .parameters import Scenario
from .problem import Design, DesignProblem, best_design
from .requirements import Quantity
from .space import Space, measure

#: Strips drawn, and relative step of the differences, by the exact engine and by ngspice.
_DRAWN = {"exact": 1024, "ngspice": 128}
_STEPS = {"exact": 1e-3, "ngspice": 1e-2}
#: Reserves have converged when they change by no more than this; rounds at most.
_SETTLED, _MOST_ROUNDS = 1e-4, 6


@dataclass(frozen=True, eq=False)
class Sensitivity:
    """Sensitivity of a design to the fit's uncertainty.

    ``stderr``: quantity -> standard error [SI]; ``shares``: quantity -> fitted parameter -> its share of the sum of
    variances that each parameter alone would cause. ``met``: requirement -> probability that it is met; ``all_met``:
    probability that all are. ``drawn`` strips counted, ``failed`` of which could not be simulated.
    """

    stderr: dict[str, float]
    shares: dict[str, dict[str, float]]
    met: dict[str, float]
    all_met: float
    drawn: int
    failed: int

    def matters_most(self, name: str) -> str | None:
        """Return the fitted parameter that causes most of a quantity's uncertainty; None where it has none."""
        shares = self.shares[name]
        return max(shares, key=lambda p: shares[p]) if self.stderr[name] > 0 else None


def require_uncertainty(scenario: Scenario, name: str) -> Uncertainty:
    """Return the fit's uncertainty. Raises InputError where there is none that holds for the design."""
    if scenario.actuator.uncertainty is None:
        raise InputError(
            f"actuator '{name}' has no [uncertainty] that holds for the design: fit one with identify, and "
            "vary neither material nor coupling, which the fit determined"
        )
    return scenario.actuator.uncertainty


def sensitivity(design: Design) -> Sensitivity:
    """Return standard errors and probabilities of a design. Raises InputError where its strip has no covariance."""
    problem, uncertainty = design.problem, _uncertainty(design)
    covariance = np.array(uncertainty.covariance)
    slopes = _slopes(design)
    alone = {name: slope**2 * np.diag(covariance) for name, slope in slopes.items()}
    shares = {name: variances / (variances.sum() or 1.0) for name, variances in alone.items()}

    random = np.random.default_rng(problem.seed)
    drawn = random.multivariate_normal(
        np.zeros(len(covariance)), covariance, _DRAWN[problem.space.engine], check_valid="ignore", method="eigh"
    )
    values, failed = _measure(design, np.exp(drawn))
    met = {r.text: r.score(values[r.quantity.name]) >= 0 for r in problem.requirements}
    every = np.all(list(met.values()), axis=0) if met else np.ones(len(drawn), dtype=bool)
    return Sensitivity(
        stderr={name: _error(slope, covariance) for name, slope in slopes.items()},
        shares={n: dict(zip(uncertainty.names, share.tolist(), strict=True)) for n, share in shares.items()},
        met={text: float(each.mean()) for text, each in met.items()},
        all_met=float(every.mean()),
        drawn=len(drawn),
        failed=failed,
    )


def confident_design(problem: DesignProblem, confidence: float, extra: Sequence[Quantity] = ()) -> Design:
    """Return the best design whose requirements (``=`` excepted) are each met with probability ``confidence``.

    The reserve is the fit's standard error at the design times the normal quantile; design and reserve are computed in
    turn. Raises InputError for a confidence out of range, and where the strip has no covariance.
    """
    from scipy.stats import norm

    if not 0.5 <= confidence < 1:
        raise InputError(f"confidence {confidence:g}: give 50% or more, and less than 100%")
    quantile = float(norm.ppf(confidence))
    middle = problem.space.scenario(problem.space.rounded(np.full(len(problem.space.ranges), 0.5)))
    if isinstance(middle, Scenario):
        require_uncertainty(middle, problem.space.template.actuator.name)
    reserves = np.zeros(len(problem.requirements))
    for _ in range(_MOST_ROUNDS):
        design = best_design(problem, extra)
        wanted = quantile * _score_errors(design)
        moved = float(np.abs(wanted - reserves).max(initial=0.0))
        if moved <= _SETTLED:
            break
        reserves = wanted
        kept = [replace(r, reserve=float(x)) for r, x in zip(problem.requirements, reserves, strict=True)]
        problem = replace(problem, requirements=tuple(kept))
    return design


def _score_errors(design: Design) -> Array:
    """Return the standard errors (r,) of the requirements' scores; 0 for an ``=``."""
    slopes, covariance = _slopes(design), np.array(_uncertainty(design).covariance)
    errors = []
    for r in design.problem.requirements:
        value = design.exact[r.quantity.name]
        small = 1e-6 * abs(value)
        low, high = r.score(np.array([value - small, value + small]))
        error = abs(high - low) / (2 * small or 1.0) * _error(slopes[r.quantity.name], covariance)
        errors.append(0.0 if r.relation == "=" else float(error))
    return np.array(errors)


def _uncertainty(design: Design) -> Uncertainty:
    return require_uncertainty(design.scenario, design.problem.space.template.actuator.name)


def _error(slope: Array, covariance: Array) -> float:
    """Return the first-order standard error of a quantity with ``slope`` (p,)."""
    return math.sqrt(max(float(slope @ covariance @ slope), 0.0))


def _slopes(design: Design) -> dict[str, Array]:
    """Return the slopes (p,) of each quantity with respect to the logarithms of the p fitted parameters."""
    step = _STEPS[design.problem.space.engine]
    steps = step * np.eye(len(_uncertainty(design).names))
    values, _ = _measure(design, np.exp(np.concatenate([steps, -steps])))
    return {name: (column[: len(steps)] - column[len(steps) :]) / (2 * step) for name, column in values.items()}


def _measure(design: Design, factors: Array) -> tuple[dict[str, Array], int]:
    """Return each quantity (k,) for strips with fitted parameters multiplied by ``factors`` (k, p), and the failures.

    Quantities that take no simulation are chosen sizes; the fit does not make them uncertain.
    """
    scenario, names = design.scenario, _uncertainty(design).names
    band = transient_band(sample_times(scenario.duration))
    scenarios: list[Scenario | str] = []
    for row in factors:
        try:
            moved = scaled(scenario.actuator, dict(zip(names, row.tolist(), strict=True)), band)
        except IlgError as error:
            scenarios.append(str(error))
        else:
            scenarios.append(replace(scenario, actuator=moved))
    quantities = design.problem.quantities
    found, evaluation = measure(scenarios, {}, [q for q in quantities if q.outputs], design.problem.space.engine)
    chosen = {q.name: np.full(len(scenarios), design.exact[q.name]) for q in quantities}
    return chosen | found, len(evaluation.failures)


#: Base samples, by the exact engine and by ngspice; each takes (parameters + 2) simulations.
SAMPLES = {"exact": 1024, "ngspice": 64}


@dataclass(frozen=True, eq=False)
class SobolIndices:
    """First-order and total indices (q, p) of q quantities and p parameters, with half widths of their 95 % intervals.

    NaN for a quantity that does not vary, or that some design within the ranges does not have. Parameters are uniform
    over their ranges, in the logarithm where these are positive.
    """

    quantities: tuple[str, ...]
    parameters: tuple[str, ...]
    first: Array
    first_error: Array
    total: Array
    total_error: Array
    simulations: int

    def table(self) -> tuple[Column, ...]:
        """Return a row for each quantity and parameter."""
        pairs = [(q, p) for q in self.quantities for p in self.parameters]
        names = ("first", "first_ci95", "total", "total_ci95")
        tables = (self.first, self.first_error, self.total, self.total_error)
        return (
            Column("quantity", [q for q, _ in pairs]),
            Column("parameter", [p for _, p in pairs]),
            *(Column(name, table.ravel(), "") for name, table in zip(names, tables, strict=True)),
        )


def sobol_indices(
    space: Space, quantities: Sequence[Quantity], *, samples: int | None = None, seed: int = 0
) -> SobolIndices:
    """Return the indices of ``quantities`` over the whole space; ``samples`` is a power of two. Raises as `indices`."""
    names, samples = tuple(q.name for q in quantities), samples or SAMPLES[space.engine]
    return indices(lambda points: space.evaluate(points, quantities), space.names, names, samples=samples, seed=seed)


def indices(
    function: Callable[[Array], Array],
    parameters: tuple[str, ...],
    quantities: tuple[str, ...],
    *,
    samples: int,
    seed: int = 0,
) -> SobolIndices:
    """Return the indices of ``function``, from points (k, p) in the unit cube to values (k, q).

    Raises InputError for a number of samples that is no power of two, MissingLibraryError without SALib.
    """
    require_sensitivity()
    from SALib.analyze import sobol as analysis
    from SALib.sample import sobol as sampling

    if samples < 8 or samples & (samples - 1):
        raise InputError(f"{samples} samples for Sobol indices: give a power of two from 8 on, such as 1024")
    problem = {"num_vars": len(parameters), "names": list(parameters), "bounds": [[0.0, 1.0]] * len(parameters)}
    points = sampling.sample(problem, samples, calc_second_order=False, seed=seed)
    values = function(points)
    table = np.full((4, len(quantities), len(parameters)), np.nan)
    for k, column in enumerate(values.T):
        if np.isfinite(column).all() and np.ptp(column) > 1e-9 * np.abs(column).max():
            # a generator, because SALib ignores the seed 0
            result = analysis.analyze(problem, column, calc_second_order=False, seed=np.random.default_rng(seed))
            table[:, k] = result["S1"], result["S1_conf"], result["ST"], result["ST_conf"]
    return SobolIndices(quantities, parameters, table[0], table[1], table[2], table[3], len(points))
