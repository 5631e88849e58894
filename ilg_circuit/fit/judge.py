"""The engine of record as judge of a fit that a cheaper prediction made.

A closed form fits; then the engine of record predicts the data once, at the answer. What its residuals ask for by one
Gauss-Newton step is how far the two engines' answers lie apart: where that is a small part of the standard errors the
fit stands, else the engine of record fits again from there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Array
from ..errors import InputError
from .fitting import fit, with_starts
from .problem import Problem, Progress
from .result import FitResult

#: A fit stands where the engine of record moves no parameter by more than this part of its standard error,
MOST = 0.02
#: or no coordinate by more than this: data without noise have no standard errors to speak of.
_CLOSE = 1e-6


@dataclass(frozen=True)
class Judgement:
    """``move``: the largest step of a parameter that the engine of record asks for, in its standard errors.

    ``refitted`` tells that the answer is the engine's own fit.
    """

    move: float
    refitted: bool


def judged(found: FitResult, problem_of_record: Problem, progress: Progress = None) -> tuple[FitResult, Judgement]:
    """Return the fit as the engine of record confirms it, and by how much it would have moved.

    Parameters
    ----------
    found
        A converged fit by cheaper predictions of the same data.
    problem_of_record
        The same problem, predicted by the engine of record. It is solved once, and fitted only where that moves a
        parameter by more than 0.02 of its standard error and by more than a millionth of itself.

    Returns
    -------
    The fit, which keeps its cheaper predictions and its word on starts, and the judgement of what was ``found``.

    Raises
    ------
    InputError
        The problems have other labels or data.
    SolveError
        The engine of record cannot predict the data there, or its fit does not converge.
    """
    record = problem_of_record
    if record.labels != found.labels or not np.array_equal(record.data, found.problem.data):
        raise InputError("a fit is judged by a problem of the same parameters and data only")
    step = _step(found, record)
    with np.errstate(divide="ignore", invalid="ignore"):
        moves = np.where(step == 0, 0.0, np.abs(step) / found.errors)
    move = float(moves.max(initial=0.0))
    beyond = (moves > MOST) & (np.abs(step / found.units) > _CLOSE)
    if not beyond.any():
        return found, Judgement(move, refitted=False)
    again = with_starts(fit(record, found.values, progress), found.starts)
    return again.predicting(found.problem), Judgement(move, refitted=True)


def _step(found: FitResult, record: Problem) -> Array:
    """Return the Gauss-Newton step (n,) of the values, by the slopes of the fit and the residuals of the record."""
    residuals = record.data - record.predicted(found.values[None])[0]
    size = np.linalg.norm(found.slopes, axis=0)
    whole = np.linalg.lstsq(found.slopes / size, residuals, rcond=None)[0] / size
    # the linear terms' part of the step is measured from zero, the values' from where they are
    return np.asarray(whole[: len(found.values)])
