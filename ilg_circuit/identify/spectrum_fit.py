"""The fit of one electrical model to an impedance spectrum.

The closed form of the port (no ladder, no engine) is fitted to real and imaginary parts together, each weighted by
1/abs(Z) unless told otherwise. Logarithms of the parameters are fitted (see `least_squares`), from many starts that
the data suggest; lmfit finishes the best and gives the covariance. What the data do not feel is held and named, above
all an electron path that is practically open.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from ..arrays import ComplexArray
from ..errors import InputError, SolveError
from ..fit.identifiability import DETERMINED
from ..fit.least_squares import Fit, fit_circuit
from ..fit.multistart import Search, gather, search
from ..fit.problem import Scales
from ..measurements.spectrum_files import Spectrum
from ..strip.models import ElectricalModel, Ladders, electrical_model
from ..strip.port import Port
from ..units import format_quantity

Array = NDArray[np.float64]
Weighting = Literal["modulus", "unit", "proportional"]

#: An open electron path: beyond any measured impedance by this factor in the strip that is handed on.
_OPEN = 1e6
_UNSEEN_PATH = "no electron path is seen beside the ions' (an open circuit fits as well)"
_OPEN_PATH = "no electron path is seen: practically an open circuit"
#: So many ohms are infinitely many, without the trouble of infinity.
_INFINITE = 1e200
#: A parameter is not felt whose logarithm alone, all others held, has a standard error beyond this.
_FELT = 3.0
#: Logarithms of SI values stay within this: beyond lies no number worth having.
_RANGE = 100.0
#: The same of the logarithm p/(1 - p) of a limited one.
_LIMITED_RANGE = 20.0
_STEP = 1e-4
_FITS, _MORE_FITS = 8, 12
_EVALUATIONS = 150


@dataclass(frozen=True)
class SpectrumFit:
    """Fit of one electrical model, Re held. ``fit`` holds the parameters that were free, in the model's order.

    ``values`` are all of them; ``held`` says of each that was not free, why. ``fitted`` [ohm] (f,) is the model at the
    spectrum's frequencies; ``starts`` of the search, ``agreeing`` of them at the best minimum.
    """

    model: str
    fit: Fit
    values: dict[str, float]
    intervals: dict[str, tuple[float, float]]
    held: dict[str, str]
    port: Port
    spectrum: Spectrum
    fitted: ComplexArray
    weighting: Weighting
    starts: int
    agreeing: int

    @property
    def residuals(self) -> ComplexArray:
        """data - fit [ohm] (f,)."""
        return np.asarray(self.spectrum.impedance - self.fitted)

    @property
    def rmse(self) -> float:
        """Root of the mean square of the residuals' real and imaginary parts [ohm]."""
        return float(np.sqrt(np.mean(np.abs(self.residuals) ** 2) / 2))

    @property
    def relative_rms(self) -> float:
        """Root of the mean square of the residuals' real and imaginary parts, each over abs(data)."""
        return float(np.sqrt(np.mean((np.abs(self.residuals) / self.spectrum.modulus) ** 2) / 2))

    @property
    def open_circuit(self) -> bool:
        """Whether no electron path is seen."""
        return "dc_resistance" in self.held

    @property
    def undetermined(self) -> tuple[str, ...]:
        """Parameters that these data do not determine: not felt, or with a standard error over half of them."""
        unfelt = [name for name in self.held if name != "dc_resistance"]
        f = self.fit
        loose = [n for n, v, e in zip(f.names, f.values, f.errors, strict=True) if not e <= DETERMINED * v]
        constants = [r * c for r, c in self.port.branches]
        alike = [f"resistance_{k + 1}" for k, (a, b) in enumerate(pairwise(constants)) if not b > 1.5 * a]
        return tuple(dict.fromkeys([*unfelt, *loose, *alike]))

    @property
    def unreliable(self) -> str:
        """Why the fit should not be chosen; empty where nothing speaks against it."""
        if self.undetermined:
            return f"not determined: {', '.join(self.undetermined)}"
        return "" if self.agreeing > 1 else f"the best of {self.starts} fits was not reached twice"

    @property
    def independent(self) -> float:
        """Number of independent readings that the residuals amount to (AR(1) along the frequencies)."""
        return _independent(self.fit.residuals)


def fit_spectrum(
    spectrum: Spectrum,
    model: str,
    electrode_resistance: float = 0.0,
    *,
    weighting: Weighting = "modulus",
    seed: int = 0,
    progress: Callable[[], None] | None = None,
) -> SpectrumFit:
    """Fit ``model`` (linear ones of `ilg_circuit.strip.models`) to a spectrum, Re held [ohm].

    Raises InputError for a model or an Re that cannot be, or too few points; SolveError for a fit that does not
    converge.
    """
    kind = _linear(model)
    problem = _Problem(kind, spectrum, electrode_resistance, weighting)
    readings, unknowns = 2 * len(spectrum.frequency), len(kind.parameters)
    if readings < unknowns + 3:
        raise InputError(f"{spectrum.source}: {len(spectrum.frequency)} points are too few for model {model}")
    random = np.random.default_rng(seed)
    free = np.ones(unknowns, dtype=bool)
    found = _searched(problem, free, np.zeros(unknowns), random)
    x = problem.within(found.best.parameters, free)
    held: dict[str, str] = {}
    closed = free.copy()
    closed[0] = False
    opened = x.copy()
    opened[0] = np.log(_INFINITE)
    without = _searched(problem, closed, opened, random, x[closed])
    # what Rdc gains must be worth a parameter, by as many readings as are independent
    rest = problem.modelled(problem.scales.values(x)[None])[0] - problem.data
    independent = _independent(rest)
    gain = independent * np.log(max(without.best.squares, 1e-300) / max(found.best.squares, 1e-300))
    doubtful = problem.lonely_error(x, found.best.squares)[0] * np.sqrt(readings / independent) > DETERMINED
    if gain < np.log(independent) or doubtful:
        free, found = closed, without
        x = opened
        x[closed] = problem.within(without.best.parameters, closed)
        held["dc_resistance"] = _open_text(problem, x, closed)
    x = problem.sorted(x)
    alone = problem.lonely_error(x, found.best.squares)
    for k in np.flatnonzero(free & ~(alone < _FELT)):
        held[kind.names[k]] = "not determined: the spectrum does not feel it"
        free[k] = False
    fit = _finish(problem, free, x, progress)
    if float(fit.residuals @ fit.residuals) > found.best.squares * (1 + 1e-6) + 1e-24:
        raise SolveError(f"the fit of model {model} did not come back to the best of its {len(found.runs)} starts")
    return _result(problem, free, x, fit, held, found)


def _independent(residuals: Array) -> float:
    """As `SpectrumFit.independent`, of residuals (2 f,), real parts first."""
    parts = np.split(residuals, 2)
    power = sum(float(p @ p) for p in parts)
    shared = sum(float(p[1:] @ p[:-1]) for p in parts)
    correlation = min(max(shared / power, 0.0), 0.999) if power else 0.0
    return float(max(len(residuals) * (1 - correlation) / (1 + correlation), 5.0))


def require_electrode_resistance(spectrum: Spectrum, held: float) -> None:
    """Raise InputError where Re [ohm] is no resistance, or more than the spectrum shows."""
    if not (np.isfinite(held) and held >= 0):
        raise InputError(f"electrode resistance {held:g} ohm must be zero or more")
    real = np.sort(spectrum.impedance.real)
    least = float(np.median(real[: max(len(real) // 20, 1)]))
    if held and held >= least:
        raise InputError(f"electrode resistance {held:g} ohm is too large: the real part falls to {least:.4g} ohm")


def _linear(model: str) -> ElectricalModel:
    kind = electrical_model(model)
    if not kind.linear:
        unseen = ", ".join(kind.needs_several_voltages)
        raise InputError(f"model {model}: a spectrum, a small signal about 0 V, does not show {unseen}; leave it out")
    return kind


class _Problem:
    """Weighted readings (2 f,), real parts first, and the model in unlimited coordinates."""

    def __init__(self, kind: ElectricalModel, spectrum: Spectrum, held: float, weighting: Weighting) -> None:
        if weighting not in get_args(Weighting):
            raise InputError(f"weighting is '{weighting}'; choose one of {', '.join(get_args(Weighting))}")
        require_electrode_resistance(spectrum, held)
        z = spectrum.impedance
        self.kind, self.spectrum, self.held, self.weighting = kind, spectrum, held, weighting
        self.s: ComplexArray = np.asarray(2j * np.pi * spectrum.frequency, dtype=complex)
        self.weights = _weights(z, weighting)
        self.data = self._flat(z)
        self.scales = Scales(np.array([p.upper for p in kind.parameters]))

    def _flat(self, z: ComplexArray) -> Array:
        return np.asarray(np.concatenate([z.real, z.imag], axis=-1) * self.weights)

    def within(self, part: Array, free: NDArray[np.bool_]) -> Array:
        """Coordinates (free,) kept within what numbers can tell apart."""
        limits = np.where(np.isinf(self.scales.below), _RANGE, _LIMITED_RANGE)[free]
        return np.asarray(np.clip(part, -limits, limits))

    def modelled(self, values: Array) -> Array:
        """Weighted model (m, 2 f) of values (m, n)."""
        return self._flat(self.kind.impedance(values, self.s, self.held))

    def jacobian(self, x: Array, free: NDArray[np.bool_]) -> Array:
        """Derivatives (2 f, free) by the free coordinates, central differences."""
        steps = _STEP * np.eye(len(x))[free]
        waves = self.modelled(self.scales.values(np.concatenate([x + steps, x - steps])))
        return np.asarray((waves[: len(steps)] - waves[len(steps) :]).T / (2 * _STEP))

    def lonely_error(self, x: Array, squares: float) -> Array:
        """Standard error (n,) of every coordinate, all others held: a lower limit of the true one."""
        everything = np.ones(len(x), dtype=bool)
        slopes = self.jacobian(x, everything)
        size = np.sqrt((np.where(np.isfinite(slopes), slopes, 0.0) ** 2).sum(axis=0))
        deviation = np.sqrt(squares / max(len(self.data) - len(x), 1)) + 1e-9
        with np.errstate(divide="ignore"):
            return np.asarray(deviation / size)

    def sorted(self, x: Array) -> Array:
        """Coordinates with R-C branches by ascending time constant: a sum does not tell their order."""
        return np.asarray(x[self.kind.order(self.scales.values(x))])


def _weights(z: ComplexArray, weighting: Weighting) -> Array:
    """1/deviation (2 f,) of real and imaginary parts, up to a factor."""
    size = np.abs(z)
    if weighting == "unit":
        return np.full(2 * len(z), 1 / float(np.sqrt(np.mean(size**2))))
    if weighting == "modulus":
        return np.concatenate([1 / size, 1 / size])
    # a part that crosses zero would count for everything
    parts = np.abs(np.concatenate([z.real, z.imag]))
    return np.asarray(1 / np.maximum(parts, 1e-2 * np.concatenate([size, size])))


def _searched(
    problem: _Problem, free: NDArray[np.bool_], base: Array, random: np.random.Generator, near: Array | None = None
) -> Search:
    """Fits of the free coordinates from starts that the data suggest, and from ``near``; the others as in ``base``."""

    def full(part: Array) -> Array:
        x = base.copy()
        x[free] = problem.within(part, free)
        return x

    def residuals(part: Array) -> Array:
        return np.asarray(problem.modelled(problem.scales.values(full(part))[None])[0] - problem.data)

    def jacobian(part: Array) -> Array:
        return problem.jacobian(full(part), free)

    def suggested(count: int) -> list[Array]:
        omega = 2 * np.pi * problem.spectrum.frequency
        sets = problem.kind.spectrum_starts(problem.spectrum.impedance - problem.held, omega, random)
        x = np.array([problem.scales.coordinates(v) for v in sets])
        x[:, ~free] = base[~free]
        rest = problem.modelled(problem.scales.values(x)) - problem.data
        finite: NDArray[np.bool_] = np.asarray(np.isfinite(rest).all(axis=1))
        squares = np.where(finite, (np.where(np.isfinite(rest), rest, 0.0) ** 2).sum(axis=1), np.inf)
        best = [part[np.argmin(squares[part])] for part in np.array_split(np.arange(len(x)), count)]
        return [x[k][free] for k in best if finite[k]]

    def fits(first: list[Array]) -> Search:
        return search(residuals, jacobian, first, tolerance=1e-11, most=_EVALUATIONS, rounding=1e-26, polishes=4)

    chosen = ([near] if near is not None else []) + suggested(_FITS)
    if not chosen:
        raise SolveError(f"no start of model {problem.kind.name} gives numbers for this spectrum")
    found = fits(chosen)
    if _together(found) < 2:
        more = fits([*suggested(_MORE_FITS), found.best.parameters + random.uniform(-0.3, 0.3, int(free.sum()))])
        found = gather([*found.runs, *more.runs], 1e-26)
    return found


def _together(found: Search) -> int:
    """Runs with the best sum of squares, whether or not every parameter is felt there."""
    return sum(run.squares <= found.best.squares * (1 + 1e-6) + 1e-24 for run in found.runs)


def _finish(problem: _Problem, free: NDArray[np.bool_], x: Array, progress: Callable[[], None] | None) -> Fit:
    """lmfit's answer from the best start, with the covariance of the free parameters."""
    values = problem.scales.values(x)
    names = [n for n, f in zip(problem.kind.names, free, strict=True) if f]
    if not names:
        raise SolveError(f"the spectrum determines no parameter of model {problem.kind.name}")

    def model(part: Array) -> Array:
        sets = np.tile(values, (len(part), 1))
        sets[:, free] = part
        waves = problem.modelled(sets)
        if not np.isfinite(waves).all():
            raise SolveError(f"model {problem.kind.name} has no finite impedance there")
        return waves

    return fit_circuit(
        model, problem.data, names, values[free], progress=progress, below=problem.scales.below[free], tolerance=1e-13
    )


def _open_text(problem: _Problem, x: Array, free: NDArray[np.bool_]) -> str:
    """Why Rdc is held: an open circuit, and the least resistance that the data allow (95 %, one-sided).

    Linear in the conductance G = 1/Rdc about G = 0: dZ/dG = -(Z - Re)^2, the other parameters' directions taken out.
    """
    from scipy.stats import t as student

    z = problem.kind.impedance(problem.scales.values(x)[None], problem.s, problem.held)[0]
    direction = problem._flat(-((z - problem.held) ** 2))
    rest = problem.data - problem._flat(z)
    tangent = np.linalg.qr(problem.jacobian(x, free))[0]
    whole = float(direction @ direction)
    direction = direction - tangent @ (tangent.T @ direction)
    size = float(direction @ direction)
    if size < 1e-9 * whole:  # another parameter does the same
        return _OPEN_PATH
    freedom = max(len(rest) - len(x), 1)
    best = max(float(direction @ rest) / size, 0.0)
    deviation = np.sqrt(float(rest @ rest) / freedom / size) + np.finfo(float).tiny
    limit = best + float(student.ppf(0.95, freedom) * deviation)
    told = _OPEN_PATH if limit * float(problem.spectrum.modulus.max()) < 1 else _UNSEEN_PATH
    return f"{told}, more than {format_quantity(1 / limit, 'ohm', 3)} (95 %)"


def _result(
    problem: _Problem, free: NDArray[np.bool_], x: Array, fit: Fit, held: dict[str, str], found: Search
) -> SpectrumFit:
    kind, spectrum = problem.kind, problem.spectrum
    values = problem.scales.values(x)
    values[free] = fit.values
    z = kind.impedance(values[None], problem.s, problem.held)[0]
    if "dc_resistance" in held:
        values[0] = _OPEN * float(spectrum.modulus.max())
    f = spectrum.frequency
    port = kind.port(values.tolist(), problem.held, Ladders((float(f[0]) * 0.999, float(f[-1]) * 1.001)))
    return SpectrumFit(
        model=kind.name,
        fit=fit,
        values=dict(zip(kind.names, values.tolist(), strict=True)),
        intervals={name: (low, high) for name, (low, high) in zip(fit.names, fit.intervals.tolist(), strict=True)},
        held=held,
        port=port,
        spectrum=spectrum,
        fitted=z,
        weighting=problem.weighting,
        starts=len(found.runs),
        agreeing=_together(found),
    )
