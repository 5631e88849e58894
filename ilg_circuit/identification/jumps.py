"""Fits the places of a drive's later jumps, each of which lies between two readings, and carries their errors on.

A jump's place is known within a sampling interval, and evenly likely there. A fit takes it as a normal quantity of that
standard deviation beside its parameters: the readings after the jump tell it, as far as the model allows, and what
remains unknown enters the errors. What all places have in common, the onset's among them, is profiled within its
interval besides, since an instrument that steps as it samples makes it the same each time: see `onset`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Protocol, Self, TypeVar

import numpy as np

from ..arrays import Array, Mask
from ..drive import PiecewiseLinear
from ..errors import SolveError
from ..fit.fitting import fit_near, with_starts
from ..fit.identifiability import DETERMINED
from ..fit.observation import Observation, WithSlopes
from ..fit.problem import Problem, Progress
from ..fit.result import FitResult
from ..measurements.voltage import MeasuredDrive
from .port_model import BRACKET

#: Most jumps whose places are fitted, and most readings times jumps.
_MOST_JUMPS, _LARGE = 200, 20_000_000
#: Step of a place for differences, in standard deviations, and how far places move before these are computed again.
_STEP = 0.3
#: Parts of a step that are tried, and the factor of steps for derivatives where none of them leads downwards: a jump
#: near a reading changes a current of diffusion much more than in proportion.
_PARTS, _FINE = (1.0, 0.5, 0.25, 0.125, 0.0625), 0.1
#: Effect of all places on the residuals, in their standard deviations, below which no parameter feels it.
_FELT = 0.1
#: Most rounds of places and parameters, and the step that ends them: its length in the standard deviations that remain,
#: of parameters and places together.
_ROUNDS, _SETTLED = 10, 0.05
#: Relative offset that ends fits between steps, and the most that a step draws the logarithm of a parameter along.
_ROUGH, _DRAWN = 1e-2, 0.3
#: Most evaluations of a fit between steps.
_MOST = 40
#: Factor by which residuals exceed another model's beside which places of jumps and onset are of no interest.
FAR_BEHIND = 1.2
#: Signs of moves of neighbouring jumps, by rows orthogonal.
_SIGNS = np.array([[1.0, 1, 1, 1], [1, -1, 1, -1], [1, 1, -1, -1], [1, -1, -1, 1]])
#: Singular values below which columns are alike, and least standard deviation of residuals, relative to the largest.
_SAME, _ROUNDING = 1e-10, 1e-6


class Jumping(Protocol):
    """Measured ``data`` (n,) at ``abscissa`` [s] (n,) under a drive of uncertain jumps.

    The onset is ``share`` of its interval of ``onset_width`` [s] from the middle, and all later jumps likewise of
    theirs; ``places`` [s] (j,) are shifts of the later jumps beside that, none if empty.
    """

    @property
    def abscissa(self) -> Array: ...
    @property
    def data(self) -> Array: ...
    @property
    def share(self) -> float: ...
    @property
    def measured(self) -> MeasuredDrive: ...
    @property
    def onset_width(self) -> float: ...
    @property
    def places(self) -> tuple[float, ...]: ...

    def at_share(self, share: float) -> Self:
        """Return the data with all jumps elsewhere in their intervals."""

    def at_places(self, places: Array) -> Self:
        """Return the data with other shifts of the later jumps."""


@dataclass(frozen=True, eq=False)
class WithJumps(WithSlopes):
    """A prediction that may know its derivatives by the times of jumps, too.

    ``by_jumps`` maps one set (p,) of parameters to derivatives [1/s] (m, j), of the onset and of later jumps before the
    last sample; or to None.
    """

    by_jumps: Callable[[Array], Array | None]


Data = TypeVar("Data", bound=Jumping)
#: The data of one file, and the indices of their observations.
File = tuple[Sequence[Data], Sequence[int]]
#: Index among the observations and data -> the observation with a model's prediction.
Observe = Callable[[int, Data], Observation]
#: Drive and times [s] (n,) since its onset -> responses (n,) by name.
Predict = Callable[[PiecewiseLinear, Array], dict[str, Array]]


@dataclass(frozen=True, eq=False)
class JumpErrors:
    """What the unknown places of jumps add to the errors of the ``coordinates`` (n,) of a fit.

    ``moves`` (j, n) are changes of the coordinates by independent quantities of unit variance.
    """

    coordinates: Array
    moves: Array

    @property
    def covariance(self) -> Array:
        """The covariance (n, n) of the coordinates."""
        return self.moves.T @ self.moves

    def variances(self, of: Callable[[Array], Array]) -> Array:
        """Return the variances (m,) of quantities (g, m) that ``of`` computes from coordinates (g, n).

        Moves of more than 1, as of what the data do not determine, are taken along a straight line.
        """
        sizes = np.maximum(np.abs(self.moves).max(axis=1, keepdims=True), 1.0)
        sets = of(np.vstack([self.coordinates, self.coordinates + self.moves / sizes]))
        return np.asarray((((sets[1:] - sets[0]) * sizes) ** 2).sum(axis=0))


def _all_widths(measured: MeasuredDrive, onset_width: float) -> Array:
    """Return the widths [s] (j + 1,) of the intervals of onset and later jumps."""
    return np.append(onset_width, measured.widths[1:])


def _widths(data: Jumping) -> Array:
    """Return the widths [s] (j + 1,) of the intervals of the data's jumps, the onset's first."""
    return _all_widths(data.measured, data.onset_width)


def _distances(data: Jumping) -> Array:
    """Return the distances [s] (j + 1,) of onset and later jumps from where the drive has them."""
    places = np.array(data.places) if data.places else np.zeros(len(data.measured.widths) - 1)
    return data.share * _widths(data) + np.append(0.0, places)


def at_distances(data: Data, distances: Array) -> Data:
    """Return the data with onset and later jumps at ``distances`` [s] (j + 1,) from the middles.

    All stay within their intervals, beyond which rounding or a rough place may lead.
    """
    width, later = data.onset_width, data.measured.widths[1:]
    share = float(np.clip(distances[0] / width, *BRACKET)) if width else data.share
    first, last = data.measured.ends
    return data.at_share(share).at_places(np.clip(distances[1:], first * later, last * later) - share * later)


def placed_as(data: Data, other: Jumping) -> Data:
    """Return the data with onset and later jumps where ``other`` data of the same file have them."""
    return data.at_share(other.share).at_places(np.array(other.places))


def unknown(data: Jumping) -> bool:
    """Return True if places of later jumps are unknown, and few enough to be fitted."""
    return _count(data) > 0 and not too_many(data)


def too_many(data: Jumping) -> int:
    """Return the number of later jumps whose places are unknown if they are too many to be fitted, else 0."""
    count = _count(data)
    return count if count > _MOST_JUMPS or count * len(data.data) > _LARGE else 0


def _count(data: Jumping) -> int:
    """Return the number of later jumps in unknown places before the last reading."""
    jumps = data.measured.drive.jumps(np.inf)
    widths = data.measured.widths[1:][: len(jumps)]
    return int(np.count_nonzero(widths[jumps[: len(widths)] < data.abscissa[-1]]))


def placed(
    found: FitResult,
    files: Sequence[File[Data]],
    observe: Observe[Data],
    telling: Mask | None = None,
    progress: Progress = None,
    rival: float = np.inf,
) -> tuple[FitResult, tuple[File[Data], ...], Array]:
    """Return the fit with the jumps of ``files`` where their readings place them, the files, and what is unknown.

    Onsets are among the jumps. Places of all files are fitted together, since each depends on the others' through the
    parameters, which are fitted again after every step; where that fails the jumps stay. ``telling`` (samples,) are the
    samples that place them, by default all: residuals that are no noise do not. Places are sought no further where
    residuals of one observation, over its sigma, would stay much greater than the ``rival`` [1] ones of another model.
    The last are the changes of the prediction over the sigmas (samples, j) by independent quantities of unit variance,
    near the final places.
    """
    near, there, left = _descended(found, files, observe, telling, progress, rival)
    if near is found:
        return found, there, left
    try:
        return with_starts(fit_near(near.problem, near.values, progress), found.starts), there, left
    except SolveError:
        return found, tuple(files), left


def _descended(
    found: FitResult,
    files: Sequence[File[Data]],
    observe: Observe[Data],
    telling: Mask | None,
    progress: Progress,
    rival: float,
) -> tuple[FitResult, tuple[File[Data], ...], Array]:
    """Return the same as `placed`, with a fit that is rough if it is another one than ``found``."""
    deviation = np.concatenate([_widths(data[0]) / np.sqrt(12) for data, _ in files])
    places = np.concatenate([_distances(data[0]) for data, _ in files])
    unit = np.where(deviation > 0, deviation, 1.0)
    ends = np.hstack([_ends(data[0]) for data, _ in files])
    moves = _inward(places / unit, ends)
    both, _ = _changes(found, files, observe, places, (_STEP * moves * deviation)[None])
    if float(np.linalg.norm(both)) < _STEP * _FELT * float(np.sqrt(np.mean(found.residuals**2))):
        return found, tuple(files), np.zeros((len(found.residuals), 0))
    columns, since, fine, closed = np.zeros((len(found.residuals), 0)), np.inf, 1.0, False
    for last in (*[False] * (_ROUNDS - 1), True):
        known, since = (None, 0.0) if since > _STEP else (columns * moves, since)
        moves = fine * _STEP * _inward(places / unit, ends) if known is None else moves
        columns, closed = _changes(found, files, observe, places, np.diag(moves * deviation), known)
        columns /= moves
        step, spread, weights = _step(found, columns, places / unit, ends, telling)
        settled = float(np.linalg.norm(np.linalg.solve(spread, step))) < _SETTLED
        if last or settled or FAR_BEHIND * rival * float(weights.max()) < 1:
            break
        least, drawn = _squares(found, weights, places / unit), -found.projection @ (columns @ step) / found.units
        for part in _PARTS:
            there = _moved(files, places + part * step * unit)
            again = _fitted_there(found, _observed(found.problem, there, observe), part * drawn, progress)
            if again is not None and _squares(again, weights, places / unit + part * step) < least:
                found, files, places = again, there, places + part * step * unit
                since += part * float(np.abs(step).max())
                break
        else:
            if closed or (fine < 1.0 and not since):
                break
            since, fine = np.inf, _FINE
    return found, tuple(files), columns @ spread


def _fitted_there(found: FitResult, problem: Problem, drawn: Array, progress: Progress) -> FitResult | None:
    """Return the rough fit of ``problem``, begun ``drawn`` (n,) from the coordinates of ``found``.

    It is None where it fails, or leads to where the data no longer determine a parameter: half a step may not.
    """
    start = problem.scales.values(found.coordinates + np.clip(drawn, -_DRAWN, _DRAWN))
    try:
        again = fit_near(problem, start, progress, _MOST, offset=_ROUGH)
    except SolveError:
        return None
    vague = (_vagueness(again) > np.maximum(_vagueness(found), DETERMINED)) & ~problem.scales.free
    return None if vague.any() else again


def _vagueness(found: FitResult) -> Array:
    """Return the standard errors (n,) of the coordinates, which are logarithms of what is positive."""
    return np.sqrt(np.diag(found.covariance)[: len(found.values)]) / found.units


def _observed(problem: Problem, files: Sequence[File[Data]], observe: Observe[Data]) -> Problem:
    """Return the problem with the observations of ``files``."""
    observations = list(problem.observations)
    for data, at in files:
        for k, d in zip(at, data, strict=True):
            observations[k] = observe(k, d)
    return replace(problem, observations=tuple(observations))


def _squares(found: FitResult, weights: Array, places: Array) -> float:
    """Return the sum of squares of the weighted residuals and of the ``places`` (j,) of unit variance."""
    return float(((weights * found.residuals) ** 2).sum() + (places**2).sum())


def _ends(data: Jumping) -> Array:
    """Return the bounds (2, j + 1) of `_distances`, in standard deviations: the onset's, and the later jumps'."""
    later = np.repeat(np.array(data.measured.ends)[:, None], len(data.measured.widths) - 1, axis=1)
    return np.sqrt(12) * np.hstack([[[-0.5], [0.5]], later])


def _moved(files: Sequence[File[Data]], places: Array) -> tuple[File[Data], ...]:
    """Return the files with their jumps at distances ``places`` [s] (j,), of one file after the other."""
    counts = [len(data[0].measured.widths) for data, _ in files]
    parts = np.split(places, np.cumsum(counts)[:-1])
    return tuple((tuple(at_distances(d, p) for d in data), at) for (data, at), p in zip(files, parts, strict=True))


def _inward(places: Array, ends: Array) -> Array:
    """Return signs (j,) of steps from ``places`` (j,) towards the middle between their ``ends`` (2, j)."""
    return np.where(places > ends.mean(axis=0), -1.0, 1.0)


def _changes(
    found: FitResult,
    files: Sequence[File[Data]],
    observe: Observe[Data],
    places: Array,
    moves: Array,
    before: Array | None = None,
) -> tuple[Array, bool]:
    """Return changes of the prediction over the sigmas (samples, m) by ``moves`` [s] (m, j) from ``places`` (j,).

    Where they are no closed form, those ``before`` (samples, m) are kept, if given. The second is True where all are.
    """
    problem = found.problem
    values = np.concatenate([found.values, list(problem.fixed.values())])
    changes = np.zeros((len(found.residuals), len(moves))) if before is None else before.copy()
    first, closed = 0, True
    for data, at in files:
        here = slice(first, first + len(data[0].measured.widths))
        first = here.stop
        for k, d in zip(at, data, strict=True):
            own, predict = values[problem.places[k]], problem.observations[k].predict
            known = predict.by_jumps(own) if isinstance(predict, WithJumps) else None
            closed &= known is not None
            if known is not None:
                count = min(known.shape[1], here.stop - here.start)
                changed = known[:, :count] @ moves[:, here][:, :count].T
            elif before is None:
                changed, unmoved = np.zeros((len(d.data), len(moves))), predict(own[None])[0]
                for column in np.flatnonzero(moves[:, here].any(axis=1)).tolist():
                    moved = observe(k, at_distances(d, (places + moves[column])[here]))
                    changed[:, column] = moved.predict(own[None])[0] - unmoved
            else:
                continue
            changes[problem.slices[k]] = changed / np.atleast_1d(problem.observations[k].sigma)[:, None]
    return changes, closed


def _step(
    found: FitResult, columns: Array, places: Array, ends: Array, telling: Mask | None
) -> tuple[Array, Array, Array]:
    """Return the Gauss-Newton step (j,) of ``places`` (j,) of unit variance, a root (j, j) of their covariance.

    The last are weights (samples,) of the residuals, zero for those that do not tell. ``columns`` (samples, j) are the
    prediction's derivatives. Every place stays between its ``ends`` (2, j). The parameters are free; every observation
    has the variance that parameters and places together leave. Only samples that are ``telling`` (samples,) count, by
    default all.
    """
    from scipy.optimize import lsq_linear

    tells = np.ones(len(found.residuals), dtype=bool) if telling is None else telling
    size = np.linalg.norm(found.slopes[tells], axis=0)
    slopes, residuals = found.slopes[:, size > 0] / size[size > 0], found.residuals
    whole = np.hstack([slopes, columns])[tells]
    scale, rest = np.ones(len(residuals)), np.zeros(len(residuals))
    rest[tells] = residuals[tells] - whole @ np.linalg.lstsq(whole, residuals[tells], rcond=_SAME)[0]
    spare = max(1 - whole.shape[1] / len(whole), 1 / len(whole))
    for part in found.problem.slices:
        scale[part] = max(
            float(np.sqrt(np.mean(rest[part] ** 2) / spare)), _ROUNDING * float(np.abs(residuals[part]).max())
        )
    scale[scale == 0] = 1.0
    scale = scale[tells]
    basis = np.linalg.qr(slopes[tells] / scale[:, None])[0]
    free = columns[tells] / scale[:, None]
    free -= basis @ (basis.T @ free)
    left = residuals[tells] / scale
    values, vectors = np.linalg.eigh(free.T @ free + np.eye(len(places)))
    root = np.sqrt(values)
    target = vectors.T @ (free.T @ left - places) / root
    bounds = (np.minimum(ends[0] - places, -_SAME), np.maximum(ends[1] - places, _SAME))
    step = lsq_linear(root[:, None] * vectors.T, target, bounds).x
    weights = np.zeros(len(residuals))
    weights[tells] = 1 / scale
    return step, vectors / root, weights


def by_jumps(measured: MeasuredDrive, onset_width: float, t: Array, predict: Predict) -> dict[str, Array]:
    """Return the standard deviations (n,) of responses at ``t`` [s] (n,) by unknown places of onset and later jumps.

    ``predict`` gives the responses by name. All jumps move at once, each by a standard deviation in a pattern of signs
    by which the effects of jumps next to each other do not mix.
    """
    widths = _all_widths(measured, onset_width)
    if not widths.any():
        return {}
    middle = predict(measured.moved(0.0, onset_width), t)
    squares = {name: np.zeros(len(t)) for name in middle}
    centres = np.append(0.0, np.mean(measured.ends) * widths[1:])  # of the intervals, from where the drive has jumps
    for signs in _SIGNS:
        moves = np.resize(signs, len(widths)) * widths / np.sqrt(12) + centres
        share = float(moves[0]) / onset_width if onset_width else 0.0
        moved = replace(measured, places=tuple((moves - share * widths)[1:].tolist()))
        since = np.maximum(t - moves[0], 0.0)
        at, back = np.unique(np.append(0.0, since), return_inverse=True)
        for name, values in predict(moved.moved(share, onset_width), at).items():
            squares[name] += (values[back[1:]] - middle[name]) ** 2 / len(_SIGNS)
    return {name: np.sqrt(found) for name, found in squares.items()}


def errors_of(found: FitResult, left: Array) -> JumpErrors:
    """Return what unknown changes of the prediction ``left`` (samples, j), see `placed`, add to a fit's errors."""
    return JumpErrors(found.coordinates, (found.projection @ left / found.units[:, None]).T)
