"""Uncertainty of a design: the covariance of its strip's fit, propagated to every required quantity.

Standard errors are first-order; probabilities are counted over strips drawn from the covariance. A reserve can be
added to each requirement, so that it is met with a stated confidence.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Array
from ..errors import IlgError, InputError
from ..simulation.prediction_band import scaled
from ..simulation.response import sample_times, transient_band
from ..strip.actuator import Uncertainty
from .parameters import Scenario
from .problem import Design, DesignProblem, best_design
from .quantities import Quantity
from .space import measure

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
            f"actuator '{name}' has no [uncertainty] that holds for the design: fit one with `ilg-circuit identify ... "
            "--out`, and vary neither material nor coupling, which the fit determined"
        )
    return scenario.actuator.uncertainty


def sensitivity(design: Design) -> Sensitivity:
    """Return standard errors and probabilities of a design. Raises InputError where its strip has no covariance."""
    problem, scenario = design.problem, design.scenario
    engine, quantities = problem.space.engine, problem.quantities
    uncertainty = require_uncertainty(scenario, problem.space.template.actuator.name)
    covariance = np.array(uncertainty.covariance)
    slopes = _slopes(scenario, quantities, engine)
    errors = np.sqrt(np.clip(np.einsum("pq,pr,rq->q", slopes, covariance, slopes), 0.0, None))
    alone = slopes**2 * np.diag(covariance)[:, None]
    parts = alone / np.where(alone.sum(axis=0) > 0, alone.sum(axis=0), 1.0)

    random = np.random.default_rng(problem.seed)
    drawn = random.multivariate_normal(
        np.zeros(len(covariance)), covariance, _DRAWN[engine], check_valid="ignore", method="eigh"
    )
    values, failed = _measure(scenario, np.exp(drawn), quantities, engine)
    for k, q in enumerate(quantities):
        if not q.outputs:  # a size that was chosen, which no fit makes uncertain
            values[:, k] = design.exact[q.name]
    met = {r.text: r.score(values[:, problem.column(r.quantity)]) >= 0 for r in problem.requirements}
    every = np.all(list(met.values()), axis=0) if met else np.ones(len(drawn), dtype=bool)
    return Sensitivity(
        {q.name: float(x) for q, x in zip(quantities, errors, strict=True)},
        {q.name: dict(zip(uncertainty.names, parts[:, k].tolist(), strict=True)) for k, q in enumerate(quantities)},
        {text: float(each.mean()) for text, each in met.items()},
        float(every.mean()),
        len(drawn),
        failed,
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
    problem, scenario = design.problem, design.scenario
    slopes = _slopes(scenario, problem.quantities, problem.space.engine)
    covariance = np.array(require_uncertainty(scenario, problem.space.template.actuator.name).covariance)
    errors = []
    for r in problem.requirements:
        k = problem.column(r.quantity)
        value = design.exact[r.quantity.name]
        small = 1e-6 * abs(value)
        slope = (r.score(np.array([value + small])) - r.score(np.array([value - small])))[0] / (2 * small or 1.0)
        error = abs(slope) * np.sqrt(max(float(slopes[:, k] @ covariance @ slopes[:, k]), 0.0))
        errors.append(0.0 if r.relation == "=" else float(error))
    return np.array(errors)


def _slopes(scenario: Scenario, quantities: tuple[Quantity, ...], engine: str) -> Array:
    """Return the slopes (p, q) of the quantities with respect to the logarithms of the p fitted parameters."""
    uncertainty = scenario.actuator.uncertainty
    assert uncertainty is not None
    step, n = _STEPS[engine], len(uncertainty.names)
    factors = np.exp(step * np.concatenate([np.eye(n), -np.eye(n)]))
    values, _ = _measure(scenario, factors, quantities, engine)
    return (values[:n] - values[n:]) / (2 * step)


def _measure(scenario: Scenario, factors: Array, quantities: tuple[Quantity, ...], engine: str) -> tuple[Array, int]:
    """Return values (k, q) for strips whose fitted parameters are multiplied by ``factors`` (k, p), and the failures.

    Quantities that take no simulation are zero.
    """
    uncertainty = scenario.actuator.uncertainty
    assert uncertainty is not None
    band = transient_band(sample_times(scenario.duration))
    scenarios: list[Scenario | str] = []
    for row in factors:
        try:
            moved = scaled(scenario.actuator, dict(zip(uncertainty.names, row.tolist(), strict=True)), band)
        except IlgError as error:
            scenarios.append(str(error))
        else:
            scenarios.append(replace(scenario, actuator=moved))
    simulated = [q for q in quantities if q.outputs]
    found, evaluation = measure(scenarios, {}, simulated, engine)
    values = np.zeros((len(scenarios), len(quantities)))
    values[:, [k for k, q in enumerate(quantities) if q.outputs]] = found
    return values, len(evaluation.failures)
