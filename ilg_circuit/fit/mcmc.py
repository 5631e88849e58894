"""Samples the posterior of a fit's parameters by Markov chain Monte Carlo, an affine-invariant ensemble (emcee).

The prior is flat in the coordinates, the logarithms, within a factor of a thousand about the fit. The noise's
variance (prior 1/variance) and the k linear nuisance terms (flat) are integrated out. The marginal posterior is
squares^(-(samples - k)/2), with the sum of squares minimised over the nuisance terms; for a linear model it is
Student's t about the fit. If residuals are autocorrelated, the increase of the sum of squares is scaled as in
`profile`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Array
from ..errors import IlgError, InputError, argument
from .problem import Progress
from .result import FitResult

#: The prior's half width, in logarithms.
_REACH = float(np.log(1e3))
_WALKERS_A_PARAMETER, _LEAST_WALKERS = 6, 24
_CHUNK, _MOST_STEPS = 200, 4000
#: Length of a converged chain, and of its discarded beginning, in autocorrelation times.
_LONG, _BURN = 50.0, 5.0


@dataclass(frozen=True)
class Chain:
    """Samples (draws, n) of the parameters, in their units, with diagnostics of the chain.

    ``autocorrelation`` time and ``steps`` are in steps of the ensemble of ``walkers``, discarded steps included.
    """

    draws: Array
    intervals: Array
    walkers: int
    steps: int
    autocorrelation: float
    acceptance: float

    @property
    def converged(self) -> bool:
        return self.steps >= _LONG * self.autocorrelation

    @property
    def length(self) -> str:
        """The length of the chain, in words."""
        times = self.steps / self.autocorrelation
        verdict = "" if self.converged else f", less than the {_LONG:.0f} that a converged chain has"
        return f"{self.walkers} walkers, {self.steps} steps, {times:.0f} autocorrelation times{verdict}"


def sample(
    fit: FitResult,
    widening: Array,
    progress: Progress = None,
    *,
    seed: int = 0,
    most_steps: int = _MOST_STEPS,
) -> Chain:
    """Return the chain of ``fit``; ``widening`` (n,) is `reported.widening`.

    It ends when it is long enough, or after ``most_steps``; `Chain.converged` distinguishes these. The walkers of half
    the ensemble move together, so that their circuits are solved at once. Raises InputError if emcee is not installed.
    """
    try:
        import emcee
    except ImportError:
        raise InputError(
            f"{argument('intervals', 'mcmc')} needs emcee: pip install 'ilg-circuit[mcmc]', or choose profile"
        ) from None

    n = len(fit.values)
    origin, problem = fit.coordinates, fit.problem
    steps = widening * fit.pooled_errors / fit.units
    shape = np.linalg.cholesky(fit.covariance[:n, :n] / np.outer(fit.units, fit.units)) * float(
        np.mean(steps * fit.units / fit.errors)
    )
    weight = float(np.exp(-2 * np.mean(np.log(widening))))
    exponent = -0.5 * (fit.degrees_of_freedom + n)
    least = float(problem.sum_of_squares(origin[None])[0])

    def log_posterior(x: Array) -> Array:
        result = np.full(len(x), -np.inf)
        inside = (np.abs(x - origin) < _REACH).all(axis=1)
        if inside.any():
            result[inside] = exponent * np.log(least + weight * (_squares(fit, x[inside]) - least))
        if progress:
            progress()
        return result

    walkers = max(_WALKERS_A_PARAMETER * n, _LEAST_WALKERS)
    sampler = emcee.EnsembleSampler(walkers, n, log_posterior, vectorize=True, moves=_moves())
    random = np.random.RandomState(seed)
    sampler.random_state = random.get_state()
    at = origin + np.clip(random.standard_normal((walkers, n)) @ shape.T, -2 * steps, 2 * steps)
    state = emcee.State(at, random_state=random.get_state())
    time = np.inf
    while sampler.iteration < most_steps and sampler.iteration < _LONG * time:
        state = sampler.run_mcmc(state, min(_CHUNK, most_steps - sampler.iteration), skip_initial_state_check=True)
        time = float(np.max(sampler.get_autocorr_time(tol=0, quiet=True)))
    burn = min(int(_BURN * time), sampler.iteration // 2)
    chain = sampler.get_chain(discard=burn, flat=True)
    values = problem.scales.values(np.asarray(chain))
    low, high = np.quantile(values, [0.025, 0.975], axis=0)
    return Chain(
        draws=values,
        intervals=np.column_stack([low, high]),
        walkers=walkers,
        steps=int(sampler.iteration),
        autocorrelation=time,
        acceptance=float(np.mean(sampler.acceptance_fraction)),
    )


def _moves() -> list[tuple[object, float]]:
    """Return moves of differential evolution: affine-invariant like the stretch move, faster in several dimensions."""
    from emcee import moves

    return [(moves.DEMove(), 0.8), (moves.DESnookerMove(), 0.2)]


def _squares(fit: FitResult, x: Array) -> Array:
    """Return the sums of squares (m,) at coordinates (m, n), infinite where the circuit cannot be solved."""
    try:
        return fit.problem.sum_of_squares(x)
    except IlgError:
        if len(x) == 1:
            return np.full(1, np.inf)
        half = len(x) // 2  # one invalid set makes the whole netlist fail: bisect
        return np.concatenate([_squares(fit, x[:half]), _squares(fit, x[half:])])
