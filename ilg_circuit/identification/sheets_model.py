"""The impedance of a strip whose electrodes are sheets with a resistance along them, as a least-squares problem.

With r [ohm/m] of both sheets and the admittance y [S/m] of a length of strip, a line of length L that is open at its
far end has Zin = sqrt(r/y) coth(gamma L), gamma^2 = r y: that of the strip without sheets, 1/(y L), times g coth g. A
strip with a contact at both ends is two lines of half its length in parallel. The part of the strip under a contact has
no sheets' resistance.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal, get_args

import numpy as np

from ..arrays import Array, ComplexArray
from ..errors import InputError, SolveError, argument, wrong_choice
from ..fit.fitting import finished
from ..fit.limits import least_squares
from ..fit.minimise import gauss_newton
from ..fit.observation import Predict
from ..fit.parameter import Parameter
from ..fit.problem import Problem
from ..fit.result import FitResult
from ..strip.models import ElectricalModel
from .impedance import FELT, ImpedanceData
from .open_path import OPEN_PATH
from .port_model import DC, ELECTRODE_RESISTANCE, observed

Contact = Literal["end", "both"]

#: The sheets' resistance, both added.
SHEETS = Parameter("sheet_resistance", "Rs", "ohm", "resistance of both sheets, per square")
#: Starts: resistances of the sheets of the longest strip, over its median impedance; number of descents.
_STARTS, _DESCENTS = (1e-2, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0), 4
#: The least resistance of the sheets, likewise: there is none.
LEAST = 1e-5
#: Condition of the slopes above which there is no covariance.
_SINGULAR = 1e9
#: Relative difference of sums of squares below which two descents reached the same minimum.
_SAME = 1e-6
#: Slopes that stand for none.
_FLAT = 1e-60
#: Steps of derivatives by the sheets' resistance, over the median impedance.
_STEP = 1e-3


@dataclass(frozen=True)
class Line:
    """A strip's line: ``length`` [m] outside the contacts, ``width`` [m]; ``contact`` at one end or at both ends.

    ``contact_length`` [m] is that of each contact. ``reference`` [m] is the length of the strip whose port the
    parameters are.
    """

    length: float
    width: float
    reference: float
    contact: Contact = "end"
    contact_length: float = 0.0

    def __post_init__(self) -> None:
        if self.contact not in get_args(Contact):
            raise wrong_choice("contact", self.contact, get_args(Contact))
        sizes = {"lengths": self.length, "width": self.width, "length": self.reference}
        for name, size in sizes.items():
            if not (np.isfinite(size) and size > 0):
                raise InputError(f"{argument(name)}: {size:g} m must be more than zero")
        if not (np.isfinite(self.contact_length) and self.contact_length >= 0):
            raise InputError(f"{argument('contact_length')} is {self.contact_length:g} m; it must be zero or more")

    @property
    def contacts(self) -> int:
        return 2 if self.contact == "both" else 1

    @property
    def unit(self) -> float:
        """Ohm of the sheets along the whole length, per ohm per square."""
        return self.length / self.width

    def square(self, port: ComplexArray, sheets: Array) -> ComplexArray:
        """Return (gamma L)^2 (m, f), L from a contact to the end of its line, for sheets (m, 1) [ohm per square]."""
        return np.asarray(sheets * self.unit * self.length / (self.contacts**2 * port * self.reference))

    def impedance(self, port: ComplexArray, sheets: Array) -> ComplexArray:
        """Return Zin [ohm] (m, f) for the impedance ``port`` (m, f) of the reference length without sheets."""
        square = self.square(port, sheets)
        g = np.sqrt(square.astype(complex))
        small = np.abs(square) < 1e-8
        factor = np.where(small, 1 + square / 3, g / np.tanh(np.where(small, 1.0, g)))
        covered = self.contacts * self.contact_length / self.length
        return np.asarray(port * self.reference / self.length / (covered + 1 / factor))

    def port(self, impedance: ComplexArray, sheets: float) -> ComplexArray:
        """Return an estimate of the port's impedance (f,) from Zin (f,): g coth g is about sqrt(1 + g^2)."""
        along = sheets * self.unit / self.contacts**2
        own = (np.sqrt(along**2 + 4 * impedance**2) - along) / 2
        covered = self.contacts * self.contact_length
        return np.asarray(own * (self.length + covered) / self.reference)


@dataclass(frozen=True)
class SheetsModel:
    """An electrical ``kind`` of the strip between sheets, in series with Re: ``held`` [ohm], or a parameter if None."""

    kind: ElectricalModel
    held: float | None

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (*self.kind.parameters, SHEETS, *(() if self.held is not None else (ELECTRODE_RESISTANCE,)))

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(p.name for p in self.parameters)

    @cached_property
    def bare(self) -> ElectricalModel:
        """The model without additions, which are in series with the whole line."""
        return ElectricalModel(self.kind.ions)

    def bare_port(self, values: Array, s: ComplexArray) -> ComplexArray:
        """Return the impedance (m, f) of the reference length without sheets and leads, of values (m, n)."""
        return self.bare.impedance(values[:, : len(self.bare.names)], s)

    def impedance(self, values: Array, s: ComplexArray, line: Line) -> ComplexArray:
        """Return Zin [ohm] (m, f) of sets of ``values`` (m, n) in the order of ``names``."""
        at, first = self.names.index(SHEETS.name), len(self.bare.names)
        with np.errstate(all="ignore"):
            z = line.impedance(self.bare_port(values, s), values[:, at : at + 1])
            for k, addition in enumerate(self.kind.additions, first):
                z = z + addition.in_series(values[:, k], s)
        return np.asarray(z + (values[:, -1:] if self.held is None else self.held))

    def predict(self, data: ImpedanceData, line: Line) -> Predict:
        """Return the prediction of a spectrum."""
        return lambda values: data.numbers(self.impedance(values, data.s, line))

    def problem(self, data: Sequence[ImpedanceData], lines: Sequence[Line]) -> Problem:
        """Return the problem of all spectra, which share every parameter."""
        seen = tuple(
            observed(d, self.names, self.predict(d, line), np.zeros((len(d.data), 0)), 1.0, channels=2)
            for d, line in zip(data, lines, strict=True)
        )
        return Problem(seen, self.parameters)


@dataclass(frozen=True, eq=False)
class Fitted:
    """A fit by ``model`` of ``data`` on ``lines``; ``fixed`` gives the reasons why parameters were not fitted.

    ``bare`` is True where the best fit has no sheets' resistance.
    """

    model: SheetsModel
    data: tuple[ImpedanceData, ...]
    lines: tuple[Line, ...]
    fit: FitResult
    fixed: dict[str, str]
    bare: bool

    @property
    def values(self) -> Array:
        """All values in the order of the model's names."""
        known = self.fit.by_label()
        return np.array([known[name] for name in self.model.names])

    def gamma_length(self, sheets: float | None = None) -> Array:
        """Return abs(gamma L) at the frequencies of all spectra, one after the other."""
        return np.concatenate([self.gamma(line, d.s, sheets) for d, line in zip(self.data, self.lines, strict=True)])

    def gamma(self, line: Line, s: ComplexArray, sheets: float | None = None) -> Array:
        """Return abs(gamma L) (f,) of one line at ``s`` (f,), for other sheets where given."""
        own = self.values[self.model.names.index(SHEETS.name)]
        given = np.array([[own if sheets is None else sheets]])
        square = line.square(self.model.bare_port(self.values[None], s), given)
        return np.asarray(np.sqrt(np.abs(square[0])))

    def expected(self, length: float) -> float:
        """Return the standard error of the sheets' resistance that one more spectrum, of a ``length`` [m], would leave.

        It has the frequencies, weights and noise of the first one. Infinite where that would leave them open.
        """
        more = replace(self.lines[0], length=length)
        return self._alone([*zip(self.data, self.lines, strict=True), (self.data[0], more)])[0] * self.fit.deviation

    @property
    def apart(self) -> float:
        """Sine of the angle between the effect of the sheets' resistance and all that the others can do: 0 for none."""
        return self._alone([*zip(self.data, self.lines, strict=True)])[1]

    def _alone(self, pairs: Sequence[tuple[ImpedanceData, Line]]) -> tuple[float, float]:
        """Return the standard error of the sheets' resistance for a noise of one, and `apart`, of spectra of lines.

        By slopes of the resistance itself, which have no singularity at zero.
        """
        names = [n for n in self.model.names if n not in self.fixed]
        values, columns = self.values, []
        size = float(np.median(self.data[0].spectrum.modulus)) / self.lines[0].unit
        for name in names:
            k = self.model.names.index(name)
            step = np.zeros(len(values))
            step[k] = _STEP * (size if name == SHEETS.name else abs(values[k]) or size)
            sets, numbers = np.array([values, values + step, values - step]), []
            for d, line in pairs:
                at, above, below = self.model.impedance(sets, d.s, line)
                slope = (above - below) / (2 * step[k]) / np.abs(at)
                numbers.append(np.concatenate([slope.real, slope.imag]))
            columns.append(np.concatenate(numbers))
        slopes = np.array(columns).T
        lengths = np.linalg.norm(slopes, axis=0)
        if not (np.isfinite(slopes).all() and (lengths > 0).all()):
            return float("inf"), 0.0
        upper = np.linalg.qr(slopes / lengths, mode="r")
        if not np.linalg.cond(upper) < _SINGULAR:
            return float("inf"), 0.0
        at = names.index(SHEETS.name)
        share = float(np.linalg.norm(np.linalg.inv(upper)[at]))
        return share / float(lengths[at]), 1 / share


def fit_sheets(model: SheetsModel, data: tuple[ImpedanceData, ...], lines: tuple[Line, ...], seed: int = 0) -> Fitted:
    """Return the fit of ``model`` to all spectra.

    Raises InputError for too few points, SolveError if none converges.
    """
    kind, problem = model.kind, model.problem(data, lines)
    points = sum(len(d.abscissa) for d in data)
    if 2 * points < len(model.names) + 3:
        raise InputError(
            f"{points} points are too few for model {kind.name} with sheets; it needs {len(model.names) // 2 + 2}"
        )
    longest = int(np.argmax([line.length for line in lines]))
    size = float(np.median(data[longest].spectrum.modulus)) / lines[longest].unit
    starts = _starts(model, data[longest], lines[longest], problem, size, np.random.default_rng(seed))
    x, squares = _best(problem, starts)
    if not np.isfinite(squares):
        raise SolveError(f"no fit of model {kind.name} with sheets converges")
    values = problem.scales.values(x)
    values[: len(kind.names)] = values[kind.order(values[: len(kind.names)])]
    x = problem.scales.coordinates(values)
    open_path = max(d.open_path() for d in data)
    fit, fixed, bare = _determined(problem, x, LEAST * size, open_path)
    if DC in fit.labels:  # an electron path must improve the BIC
        at = fit.labels.index(DC)
        if not fit.errors[at] < fit.values[at] / 2:
            closed = fit.problem.holding(DC, open_path)
            start = least_squares(closed, np.delete(fit.coordinates, at))[0]
            other, others, other_bare = _determined(closed, start, LEAST * size, open_path)
            if other.bic <= fit.bic:
                fit, bare, fixed = other, other_bare, fixed | others | {DC: OPEN_PATH}
    return Fitted(model, data, lines, fit, fixed, bare)


def _starts(
    model: SheetsModel, data: ImpedanceData, line: Line, problem: Problem, size: float, random: np.random.Generator
) -> list[Array]:
    """Return coordinates of starts, from the spectrum of one line as it would be without sheets of several sizes."""
    z, omega = data.spectrum.impedance, 2 * np.pi * data.spectrum.frequency
    leads = model.held if model.held is not None else 0.1 * max(float(z.real.min()), 1e-3 * float(np.abs(z).min()))
    found: list[tuple[float, Array]] = []
    for share in _STARTS:
        own = line.port(z - leads, share * size)
        with np.errstate(all="ignore"):
            sets = model.kind.spectrum_starts(own, omega, random)
        columns = [sets, np.full((len(sets), 1), share * size)]
        if model.held is None:
            columns.append(np.full((len(sets), 1), leads))
        x = problem.scales.coordinates(np.hstack(columns))
        x = x[np.isfinite(x).all(axis=1)]
        if not len(x):
            continue
        with np.errstate(all="ignore"):
            left = problem.predictions(x) - problem.data
            squares = np.where(np.isfinite(left).all(axis=1), (left**2).sum(axis=1), np.inf)
        best = int(np.argmin(squares))
        if np.isfinite(squares[best]):
            found.append((float(squares[best]), x[best]))
    if not found:
        raise SolveError(f"no start of model {model.kind.name} gives finite residuals for these spectra")
    return [x for _, x in sorted(found, key=lambda pair: pair[0])[:_DESCENTS]]


def _best(problem: Problem, starts: Sequence[Array]) -> tuple[Array, float]:
    """Return coordinates and sum of squares of the best descent; the first two that agree on it are enough."""
    ends: list[tuple[Array, float]] = []
    for start in starts:
        ends.append(least_squares(problem, start))
        least = min(squares for _, squares in ends)
        if sum(squares <= least * (1 + _SAME) + 1e-20 for _, squares in ends) > 1:
            break
    return min(ends, key=lambda end: end[1])


def _determined(problem: Problem, x: Array, least: float, open_path: float) -> tuple[FitResult, dict[str, str], bool]:
    """Return the fit at the minimum near coordinates ``x`` (n,), what has no effect being held, and why it is.

    Also whether it has no sheets' resistance, which is one of ``least`` [ohm per square].
    """
    x, bare = _with_least(problem, x, least)
    prediction, slopes = problem.derivatives(x)
    left = problem.data - prediction
    deviation = np.sqrt(float(left @ left) / max(len(left) - len(x), 1)) + 1e-9
    with np.errstate(divide="ignore"):
        alone = deviation / np.linalg.norm(np.nan_to_num(slopes), axis=0)
    fixed: dict[str, str] = {}
    for label, error, value in zip(problem.labels, alone, problem.scales.values(x).tolist(), strict=True):
        opened = label == DC and value > open_path
        if label == SHEETS.name or (error < FELT and not opened):
            continue
        fixed[label] = OPEN_PATH if label == DC else "not determined: the spectra do not depend on it"
        there = {DC: open_path, ELECTRODE_RESISTANCE.name: 0.0}.get(label, value)
        x = np.delete(x, problem.labels.index(label))
        problem = problem.holding(label, there)
    if fixed:
        x, bare = _with_least(problem, least_squares(problem, x)[0], least)
    return _result(problem, x), fixed, bare


def _with_least(problem: Problem, x: Array, least: float) -> tuple[Array, bool]:
    """Return coordinates with the sheets' resistance at ``least`` where it is below, and whether it was."""
    at = problem.labels.index(SHEETS.name)
    if x[at] > np.log(least):
        return x, False
    rest = least_squares(problem.holding(SHEETS.name, least), np.delete(x, at))[0]
    return np.insert(rest, at, np.log(least)), True


def _result(problem: Problem, x: Array) -> FitResult:
    """Return the fit at coordinates ``x`` (n,); its covariance is NaN where two parameters have the same effect."""
    prediction, slopes = problem.derivatives(x)
    residuals = problem.data - prediction
    slopes = np.where(np.linalg.norm(slopes, axis=0) > _FLAT, slopes, _FLAT)
    _, offset, _ = gauss_newton(slopes, -residuals)
    return finished(problem, x, np.empty(0), residuals, slopes, offset=float(offset), evaluations=1, singular=_SINGULAR)
