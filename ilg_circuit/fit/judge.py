"""Checks a fit by cheaper predictions with one prediction by the engine of record.

After a fit by a closed form the engine of record predicts the data once, at the minimum. One Gauss-Newton step from
there estimates the difference of the two engines' fits. If it is a small part of the standard errors, the fit is
accepted; otherwise it is repeated with the engine of record from there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array
from ..errors import InputError
from .fitting import fit, with_starts
from .problem import Problem, Progress
from .result import FitResult

#: Largest step of a parameter by the engine of record for an accepted fit, in standard errors.
MOST = 0.02
#: The same for a coordinate, for data without noise, whose standard errors are negligible.
_CLOSE = 1e-6


@dataclass(frozen=True)
class Judgement:
    """The outcome of the check: ``move`` is the largest step of a parameter in its standard errors.

    ``refitted`` is True if the answer is the engine's own fit.
    """

    move: float
    refitted: bool


def judged(
    found: FitResult, problem_of_record: Problem, progress: Progress = None, rows: NDArray[np.intp] | None = None
) -> tuple[FitResult, Judgement]:
    """Return the fit confirmed or repeated by the engine of record, and the judgement of the given fit.

    Parameters
    ----------
    found
        A converged fit by cheaper predictions of the same data.
    problem_of_record
        The same problem, predicted by the engine of record. It is solved once, and fitted only where that moves a
        parameter by more than 0.02 of its standard error and by more than a millionth of itself.
    rows
        The samples (m,) of ``found`` in ``problem_of_record``, if these are not all.

    Returns
    -------
    The fit, which keeps its cheaper predictions and its summary of starts, and the judgement of ``found``.

    Raises
    ------
    InputError
        The problems have other labels or data.
    SolveError
        The engine of record cannot predict the data there, or its fit does not converge.
    """
    record = problem_of_record
    chosen = slice(None) if rows is None else rows
    if record.labels != found.labels or not np.array_equal(record.data, found.problem.data[chosen]):
        raise InputError("a fit is judged by a problem of the same parameters and data only")
    step = _step(found, record, chosen)
    with np.errstate(divide="ignore", invalid="ignore"):
        moves = np.where(step == 0, 0.0, np.abs(step) / found.errors)
    move = float(moves.max(initial=0.0))
    beyond = (moves > MOST) & (np.abs(step / found.units) > _CLOSE)
    if not beyond.any():
        return found, Judgement(move, refitted=False)
    again = with_starts(fit(record, found.values, progress), found.starts)
    return again.predicting(found.problem), Judgement(move, refitted=True)


def _step(found: FitResult, record: Problem, rows: slice | NDArray[np.intp]) -> Array:
    """Return the Gauss-Newton step (n,) of the values from the fit's minimum to the engine of record's minimum.

    At the minimum the fit's own residuals give no step, so that the step follows from the difference of predictions.
    """
    at = found.values[None]
    differences = found.problem.predicted(at)[0][rows] - record.predicted(at)[0]
    slopes = found.slopes[rows]
    size = np.linalg.norm(slopes, axis=0)
    step = np.linalg.lstsq(slopes / size, differences, rcond=None)[0] / size
    return np.asarray(step[: len(found.values)])
