"""One least-squares problem: observations of any kind, with parameters that are shared or separate per record."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array
from ..errors import InputError, SolveError
from .observation import Observation, Predict, WithSlopes
from .parameter import Parameter, Scales
from .tall import products

Progress = Callable[[], None] | None

RAN_AWAY = "the fit diverged: the data do not determine every parameter of this model"
_STEP = 1e-4
#: Size above which derivatives are computed one parameter at a time.
_LARGE = 2_000_000
#: Largest sensible distance of a coordinate from its start.
_FAR = 5.0
#: Distance from the start beyond which a step is rejected without a prediction.
_FENCE = 16.0


@dataclass(frozen=True, eq=False)
class Problem:
    """A fit of ``parameters`` to ``observations``; parameters in ``per_record`` have one value per source.

    ``fixed`` are values of held parameters by label. A label is a parameter's name, with its source in brackets if it
    is per record. In a ``rough`` problem, whose minimum is only a start for another one, derivatives are one-sided.
    """

    observations: tuple[Observation, ...]
    parameters: tuple[Parameter, ...]
    per_record: frozenset[str] = frozenset()
    fixed: Mapping[str, float] = field(default_factory=dict)
    rough: bool = False

    @cached_property
    def labelled(self) -> tuple[tuple[str, Parameter], ...]:
        """All labels, of fixed values too, each with its parameter."""
        found: list[tuple[str, Parameter]] = []
        for p in self.parameters:
            if p.name in self.per_record:
                sources = dict.fromkeys(o.source for o in self.observations if p.name in o.names)
                found += [(f"{p.name}[{source}]", p) for source in sources]
            else:
                found.append((p.name, p))
        return tuple(found)

    @cached_property
    def labels(self) -> tuple[str, ...]:
        """Labels (n,) of the fitted values."""
        return tuple(label for label, _ in self.labelled if label not in self.fixed)

    @cached_property
    def moved(self) -> tuple[Parameter, ...]:
        """The parameter of each label (n,)."""
        return tuple(p for label, p in self.labelled if label not in self.fixed)

    @cached_property
    def scales(self) -> Scales:
        """Limits and coordinates of the fitted values."""
        return Scales.of(self.moved)

    @cached_property
    def slices(self) -> tuple[slice, ...]:
        """Slices of each observation's samples among all."""
        return tuple(
            slice(a, b) for a, b in pairwise(np.cumsum([0, *(len(o.data) for o in self.observations)]).tolist())
        )

    @cached_property
    def data(self) -> Array:
        """All data over their sigmas (samples,)."""
        parts = [o.weighted[0] for o in self.observations]
        return parts[0] if len(parts) == 1 else np.concatenate(parts)

    @cached_property
    def nuisance(self) -> Array:
        """All linear terms over the sigmas (samples, q), in separate columns for each observation."""
        parts = [o.weighted[1] for o in self.observations]
        if len(parts) == 1:
            return parts[0]
        whole = np.zeros((len(self.data), sum(terms.shape[1] for terms in parts)))
        at = 0
        for terms, rows in zip(parts, self.slices, strict=True):
            whole[rows, at : at + terms.shape[1]] = terms
            at += terms.shape[1]
        return whole

    @cached_property
    def places(self) -> tuple[NDArray[np.intp], ...]:
        """For each observation the indices of its ``names`` among all labels, fixed ones last."""
        order = {label: k for k, label in enumerate([*self.labels, *self.fixed])}

        def place(name: str, source: str) -> int:
            return order[f"{name}[{source}]" if name in self.per_record else name]

        return tuple(np.array([place(n, o.source) for n in o.names], dtype=np.intp) for o in self.observations)

    def predictions(self, x: Array) -> Array:
        """Return the predictions over the sigmas (k, samples) at coordinates (k, n)."""
        return self.predicted(self.scales.values(x))

    def predicted(self, values: Array) -> Array:
        """Return the predictions over the sigmas (k, samples) of values (k, n)."""
        constant = np.array(list(self.fixed.values()))
        every = np.hstack([values, np.broadcast_to(constant, (len(values), len(constant)))])
        if len(self.observations) == 1:
            only = self.observations[0]
            return only.predict(every[:, self.places[0]]) / only.sigma
        pairs = zip(self.observations, self.places, strict=True)
        return np.concatenate([_each_once(o.predict, every[:, at]) / o.sigma for o, at in pairs], axis=1)

    def derivatives(self, x: Array) -> tuple[Array, Array]:
        """Return the prediction (samples,) and its derivatives (samples, n) with respect to the coordinates ``x`` (n,).

        Without derivatives in the observations, central differences are used, with 2 n + 1 sets predicted at once; in a
        ``rough`` problem forward differences.
        """
        n = len(x)
        steps = np.concatenate([np.zeros((1, n)), _STEP * np.eye(n), -_STEP * np.eye(n)])
        if any(o.derivatives for o in self.observations):
            return self._given_derivatives(x)
        if any(isinstance(o.predict, WithSlopes) for o in self.observations):
            return self._known_slopes(x)
        if n * len(self.data) > _LARGE:  # memory: one parameter at a time
            slopes = np.empty((len(self.data), n))
            for k, step in enumerate(steps[1 : n + 1]):
                above, below = self.predictions(x + np.array([step, -step]))
                slopes[:, k] = (above - below) / (2 * _STEP)
            return self.predictions(x[None])[0], slopes
        if self.rough:
            sets = self.predictions(x + steps[: n + 1])
            return sets[0].copy(), ((sets[1:] - sets[0]) / _STEP).T
        sets = self.predictions(x + steps)
        slopes = sets[1 : n + 1] - sets[n + 1 :]
        slopes /= 2 * _STEP
        return sets[0].copy(), slopes.T

    def _given_derivatives(self, x: Array) -> tuple[Array, Array]:
        values = np.concatenate([self.scales.values(x), list(self.fixed.values())])
        slopes = np.zeros((len(self.data), len(values)))
        for o, rows, at in zip(self.observations, self.slices, self.places, strict=True):
            assert o.derivatives is not None
            slopes[rows, at] = o.derivatives(values[at]) / np.atleast_1d(o.sigma)[:, None]
        return self.predictions(x[None])[0], slopes[:, : len(x)] * self.scales.slopes(x)

    def _known_slopes(self, x: Array) -> tuple[Array, Array]:
        """Return prediction and derivatives, one observation after the other; some of them know their own."""
        values = np.concatenate([self.scales.values(x), list(self.fixed.values())])
        # of logarithms by coordinates
        turned = np.append(self.scales.slopes(x) / values[: len(x)], np.zeros(len(self.fixed)))
        only = self.observations[0]
        alone = len(self.observations) == 1 and np.array_equal(self.places[0], np.arange(len(values)))
        if alone and isinstance(only.predict, WithSlopes):
            found, slopes = only.predict.slopes(values)
            slopes *= turned
            slopes /= np.atleast_1d(only.sigma)[:, None]
            return found / only.sigma, slopes[:, : len(x)]
        # by columns: the memory of those that an observation does not depend on is never touched
        prediction, slopes = np.empty(len(self.data)), np.zeros((len(self.data), len(values)), order="F")
        for k, (o, rows, at) in enumerate(zip(self.observations, self.slices, self.places, strict=True)):
            if isinstance(o.predict, WithSlopes):
                found, by_logarithm = o.predict.slopes(values[at])
                prediction[rows] = found / o.sigma
                for column, slope in zip(at.tolist(), by_logarithm.T, strict=True):
                    slopes[rows, column] = slope * turned[column] / o.sigma
            else:
                part = self.of([k])
                columns = [self.labels.index(label) for label in part.labels]
                prediction[rows], slopes[rows, columns] = part.derivatives(x[columns])
        return prediction, slopes[:, : len(x)]

    def information(self, x: Array) -> Array:
        """Return J^T J (n, n) of the derivatives with respect to the coordinates ``x`` (n,), without the linear terms.

        One observation is predicted after the other.
        """
        found = np.zeros((len(x), len(x)))
        for k in range(len(self.observations)):
            part = self.of([k])
            columns = [self.labels.index(label) for label in part.labels]
            found[np.ix_(columns, columns)] += part.products(part.derivatives(x[columns])[1])
        return found

    def products(self, slopes: Array) -> Array:
        """Return J^T J (n, n) of ``slopes`` (samples, n) after projecting out the linear terms."""
        return np.asarray(sum(products(slopes[part], basis) for part, basis in self._bases))

    def sum_of_squares(self, x: Array) -> Array:
        """Return sums of squares (k,) at coordinates (k, n), minimised over the linear terms."""
        return (self.projected(self.data - self.predictions(x)) ** 2).sum(axis=-1)

    def projected(self, rows: Array) -> Array:
        """Return ``rows`` (..., samples) after projecting out the linear terms."""
        found = np.array(rows)
        for part, basis in self._bases:
            if basis.shape[1]:
                found[..., part] -= (rows[..., part] @ basis) @ basis.T
        return found

    @cached_property
    def _bases(self) -> tuple[tuple[slice, Array], ...]:
        """The samples of each observation, and an orthonormal basis (m, q) of its linear terms."""
        pairs = zip(self.slices, self.observations, strict=True)
        return tuple((part, np.linalg.qr(o.weighted[1])[0]) for part, o in pairs)

    def holding(self, label: str, value: float) -> Problem:
        """Return the problem with one more value fixed."""
        return replace(self, fixed={**self.fixed, label: value})

    def predicting(self, predict: Sequence[Predict | None]) -> Problem:
        """Return the problem with other predictions of its observations."""
        pairs = zip(self.observations, predict, strict=True)
        return replace(self, observations=tuple(replace(o, predict=p) if p else o for o, p in pairs))

    def of(self, chosen: Iterable[int]) -> Problem:
        """Return the problem of the ``chosen`` observations alone, with the parameters that these depend on."""
        kept = tuple(self.observations[k] for k in chosen)
        names = {name for o in kept for name in o.names}
        part = Problem(kept, tuple(p for p in self.parameters if p.name in names), self.per_record)
        known = {label for label, _ in part.labelled}
        return replace(part, fixed={label: value for label, value in self.fixed.items() if label in known})

    def components(self) -> list[list[int]]:
        """Return the observations in groups that share no parameter: each is an independent problem."""
        groups: list[tuple[set[int], list[int]]] = []
        for k, at in enumerate(self.places):
            labels = {int(i) for i in at if i < len(self.labels)}
            near = [g for g in groups if g[0] & labels]
            groups = [g for g in groups if not g[0] & labels]
            groups.append((labels.union(*(g[0] for g in near)), sorted([k, *(j for g in near for j in g[1])])))
        return sorted(members for _, members in groups)


def _each_once(predict: Predict, values: Array) -> Array:
    """Return predictions of every row, solving equal rows once: other observations' parameters have no effect here."""
    if len(values) == 1:
        return predict(values)
    rows, back = np.unique(values, axis=0, return_inverse=True)
    return predict(rows)[back.ravel()] if len(rows) < len(values) else predict(values)


class Evaluation:
    """Predictions of a problem and their derivatives, solved together and kept for a minimiser's other callback.

    ``count`` is the number of evaluations; ``unsolved`` holds the errors of those whose circuit could not be solved.
    """

    def __init__(self, problem: Problem, progress: Progress = None) -> None:
        self._problem, self._progress = problem, progress
        self._at = self._start = np.full(len(problem.labels), np.nan)
        self._result: tuple[Array, Array] = (np.empty(0), np.empty(0))
        self.count = 0
        self.unsolved: list[SolveError] = []

    def __call__(self, x: Array) -> tuple[Array, Array]:
        """Return the prediction (samples,) and its derivatives (samples, n) by the coordinates.

        Raises SolveError if the fit has diverged, or its first circuit cannot be solved.
        """
        if not self.count:
            self._start = x.copy()
        if not np.array_equal(x, self._at):
            distance = self._distance(x)
            if distance > _FENCE:
                return self._rejected()
            try:
                result = self._problem.derivatives(x)
                if not np.isfinite(result[0]).all():
                    raise SolveError("the model has no finite value there")
            except InputError:  # a value beyond all measure
                raise SolveError(RAN_AWAY) from None
            except SolveError as error:  # or one that is still a number, but no circuit that can be solved
                if distance >= _FAR:
                    raise SolveError(RAN_AWAY) from None
                if not self.count:
                    raise
                self.unsolved.append(error)
                return self._rejected()
            self._at, self._result = x.copy(), result
            self.count += 1
            if self._progress:
                self._progress()
        return self._result

    def _distance(self, x: Array) -> float:
        """Return the largest distance of a logarithm from its start; parameters without limits have none."""
        bounded = ~self._problem.scales.free
        return float(np.abs(x - self._start)[bounded].max(initial=0.0))

    def _rejected(self) -> tuple[Array, Array]:
        """Return a misfit so large that the step is rejected."""
        kept, slopes = self._result
        self.count += 1
        return kept + 1e3 * np.abs(kept).max(), slopes
