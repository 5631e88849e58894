"""Sobol indices: the share of each quantity's variance over the ranges that each parameter causes, by SALib."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ..arrays import Array
from ..errors import InputError
from ..extras import require_sensitivity
from .quantities import Quantity
from .space import Space

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


def sobol_indices(
    space: Space, quantities: Sequence[Quantity], *, samples: int | None = None, seed: int = 0
) -> SobolIndices:
    """Return the indices of ``quantities`` over the whole space; ``samples`` is a power of two. Raises as `indices`."""
    return indices(
        lambda points: space.evaluate(points, quantities),
        space.names,
        tuple(q.name for q in quantities),
        samples=samples or SAMPLES[space.engine],
        seed=seed,
    )


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
            # a generator: SALib takes seed 0 as none
            result = analysis.analyze(problem, column, calc_second_order=False, seed=np.random.default_rng(seed))
            table[:, k] = result["S1"], result["S1_conf"], result["ST"], result["ST_conf"]
    return SobolIndices(quantities, parameters, table[0], table[1], table[2], table[3], len(points))
