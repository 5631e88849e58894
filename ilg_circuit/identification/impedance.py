"""Turns a measured impedance spectrum into an observation of the port, and fits it individually.

The closed form of the port (no ladder, no engine) is fitted to real and imaginary parts together, weighted by 1/abs(Z)
by default, from many starts derived from the data. Parameters without effect on the data, above all an electron path
that is practically open, are fixed and named.
"""

from __future__ import annotations

from copy import deepcopy
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal, get_args

import numpy as np

from ..arrays import Array, ComplexArray
from ..errors import InputError, SolveError, wrong_choice
from ..findings import Finding
from ..fit.fitting import fit, with_starts
from ..fit.identifiability import DETERMINED
from ..fit.multistart import Search, StartSummary, gather, search
from ..fit.observation import Observation
from ..fit.problem import Problem, Progress
from ..measurements.smoothing import last_place
from ..measurements.spectrum import Spectrum
from ..strip.models import ElectricalModel
from .kramers_kronig import KramersKronig, kramers_kronig
from .noise_law import NoiseLaw, noise_law
from .open_path import OPEN, OPEN_PATH, told
from .port_model import ANY_LADDER, DC, INFINITE, IndividualFit, PortModel, observed, port_problem

Weighting = Literal["modulus", "unit", "proportional"]

#: Standard error of a parameter's logarithm, all others held, above which the data do not determine it.
FELT = 3.0
#: Largest absolute logarithm of a physical SI value.
_RANGE = 100.0
#: The same for the logit of a parameter with an upper limit.
_LIMITED_RANGE = 20.0
_FITS, _MORE_FITS = 8, 12
#: Evaluations of a descent, and the tolerance to which all starts descend before the best go on.
_EVALUATIONS, _ROUGH = 150, 1e-5
#: Ratio by which the sum of squares of an open electron path may still fall below that of a rough search.
_SURPRISE = 4.0
#: Relative difference of sums of squares below which two runs reached the same minimum.
_SAME = 1e-6


@dataclass(frozen=True)
class ImpedanceData:
    """An impedance over frequency [Hz], small signal about ``bias`` [V]; its numbers are Re Z and Im Z times weights.

    The weights are 1/abs(Z) for the weighting "modulus", 1/rms(abs(Z)) for "unit", and one over each part's size for
    "proportional". Points that violate the Kramers-Kronig relations are left out of ``spectrum``, not of ``measured``.
    """

    spectrum: Spectrum
    measured: Spectrum
    check: KramersKronig
    bias: float
    source: str
    weighting: Weighting = "modulus"
    law: NoiseLaw | None = None

    quantity = "impedance"
    unit = ""
    engine = "closed form"
    size = 1.0

    @classmethod
    def of(
        cls, spectrum: Spectrum, bias: float = 0.0, source: str = "", weighting: Weighting = "modulus"
    ) -> ImpedanceData:
        """Return the data of a spectrum, after its Kramers-Kronig check. Raises InputError for another weighting."""
        if weighting not in get_args(Weighting):
            raise wrong_choice("weighting", weighting, get_args(Weighting))
        check = kramers_kronig(spectrum)
        return cls(spectrum.without(check.bad), spectrum, check, bias, source or spectrum.source, weighting)

    @property
    def voltage(self) -> float:
        return self.bias

    @property
    def level(self) -> float | None:
        return self.bias

    @property
    def notes(self) -> tuple[Finding, ...]:
        return (*self.spectrum.notes, *self.check.findings)

    @property
    def abscissa(self) -> Array:
        return self.spectrum.frequency

    @property
    def s(self) -> ComplexArray:
        """2 pi i times the frequencies [rad/s]."""
        return np.asarray(2j * np.pi * self.spectrum.frequency)

    @property
    def data(self) -> Array:
        return self.numbers(self.spectrum.impedance)

    @property
    def band(self) -> tuple[float, float]:
        f = self.spectrum.frequency
        return float(f[0]) * 0.999, float(f[-1]) * 1.001

    @cached_property
    def _weights(self) -> Array:
        even = self._even_weights
        return even if self.law is None else even / np.tile(self.law.profile, 2)

    @property
    def _even_weights(self) -> Array:
        z = self.spectrum.impedance
        size = np.abs(z)
        if self.weighting == "unit":
            return np.full(2 * len(z), 1 / float(np.sqrt(np.mean(size**2))))
        if self.weighting == "modulus":
            return np.concatenate([1 / size, 1 / size])
        # a part that crosses zero would dominate all others
        parts = np.abs(np.concatenate([z.real, z.imag]))
        return 1 / np.maximum(parts, 1e-2 * np.concatenate([size, size]))

    @cached_property
    def _digits(self) -> Array:
        """Units of the last digits of the readings, as `numbers`."""
        z = self.spectrum.impedance
        return np.concatenate([last_place(z.real), last_place(z.imag)]) * self._weights

    def numbers(self, z: ComplexArray) -> Array:
        return np.concatenate([z.real, z.imag], axis=-1) * self._weights

    def shown(self, numbers: Array) -> ComplexArray:
        real, imaginary = np.split(numbers / self._weights, 2)
        return real + 1j * imaginary

    def relative_rms(self, residuals: Array) -> float:
        """Return the rms of the real and imaginary parts of ``residuals`` (2 f,), over abs(Z)."""
        return float(np.sqrt(np.mean((np.abs(self.shown(residuals)) / self.spectrum.modulus) ** 2) / 2))

    def complex_rms(self, residuals: Array) -> float:
        """Return the rms of abs(data - fit)/abs(Z), which is `relative_rms` times sqrt(2)."""
        return float(np.sqrt(2)) * self.relative_rms(residuals)

    def worst_window(self, residuals: Array) -> tuple[float, float, float]:
        """Return the decade of the band [Hz] where ``residuals`` (2 f,) are largest, and their `complex_rms` there.

        The band is cut into equal parts of a decade or a little less.
        """
        f, size = self.spectrum.frequency, np.abs(self.shown(residuals)) / self.spectrum.modulus
        edges = np.geomspace(f[0], f[-1], max(int(np.ceil(np.log10(f[-1] / f[0]) - 1e-6)), 1) + 1)
        part = np.clip(np.searchsorted(edges, f, side="right") - 1, 0, len(edges) - 2)
        rms = [
            float(np.sqrt(np.mean(size[part == k] ** 2))) if (part == k).any() else 0.0 for k in range(len(edges) - 1)
        ]
        worst = int(np.argmax(rms))
        return float(edges[worst]), float(edges[worst + 1]), rms[worst]

    def closed(self, model: PortModel) -> bool:
        return True

    def observation(self, model: PortModel, sigma: float | Array = 1.0, *, of_record: bool = False) -> Observation:
        s, kind = self.s, model.kind

        def linear(values: Array) -> Array:
            assert model.held is not None
            return self.numbers(kind.impedance(values, s, model.held))

        def about_bias(values: Array) -> Array:
            ports = [model.port(v, ANY_LADDER) for v in values]
            return self.numbers(np.array([port.impedance(s, self.bias, ideal=True) for port in ports]))

        predict = linear if kind.linear and model.held is not None else about_bias
        found = observed(self, model.names, predict, np.zeros((len(self.data), 0)), sigma, channels=2)
        return replace(found, digits=self._digits)

    channel = None
    share = 0.0
    bracketed = False

    def at_share(self, share: float) -> ImpedanceData:
        return self

    @property
    def whole(self) -> ImpedanceData:
        return self

    def trial(self) -> ImpedanceData:
        return self

    def holds(self, kind: ElectricalModel) -> bool:
        return kind.linear

    def may_be_open(self, kind: ElectricalModel) -> bool:
        return DC in kind.names

    def require_electrode_resistance(self, held: float) -> None:
        if not (np.isfinite(held) and held >= 0):
            raise InputError(f"electrode resistance {held:g} ohm must be zero or more")
        real = np.sort(self.spectrum.impedance.real)
        least = float(np.median(real[: max(len(real) // 20, 1)]))
        if held and held >= least:
            raise InputError(f"electrode resistance {held:g} ohm is too large: the real part falls to {least:.4g} ohm")

    def individual(self, kind: ElectricalModel, held: float, progress: Progress, seed: int = 0) -> IndividualFit:
        self.require_electrode_resistance(held)
        hidden = [name for name in kind.needs_several_voltages if name in kind.names]
        if hidden:
            raise InputError(
                f"model {kind.name}: a spectrum, a small signal about one voltage, does not show {', '.join(hidden)}; "
                "leave it out"
            )
        if len(self.data) < len(kind.names) + 3:
            raise InputError(
                f"{len(self.abscissa)} points are too few for model {kind.name}; it needs {len(kind.names) // 2 + 2}"
            )
        model, random = PortModel(kind, held), np.random.default_rng(seed)
        problem = port_problem((self,), model, (1.0,))
        found = self._search(problem, model, random)
        x = _within(problem, found.best.parameters)
        problem, x, found, fixed = self._without_open_path(problem, model, x, found, random)
        values = problem.scales.values(x)
        every = np.array([{**dict(zip(problem.labels, values, strict=True)), **problem.fixed}[n] for n in kind.names])
        every = every[kind.order(every)]
        at = dict(zip(kind.names, every.tolist(), strict=True))
        x = problem.scales.coordinates(np.array([at[label] for label in problem.labels]))
        alone = self._lonely_errors(problem, x, found.best.sum_of_squares)
        unfelt = tuple(label for label, error in zip(problem.labels, alone, strict=True) if not error < FELT)
        for label in unfelt:
            fixed[label] = "not determined: the spectrum does not depend on it"
            problem = problem.holding(label, at[label])
        if not problem.labels:
            raise SolveError(f"the spectrum determines no parameter of model {kind.name}")
        start = np.array([at[label] for label in problem.labels])
        result = fit(problem, start, progress, tolerance=1e-13)
        if result.sum_of_squares > found.best.sum_of_squares * (1 + _SAME) + 1e-24:
            raise SolveError(f"the fit of model {kind.name} did not return to the best of its {len(found.runs)} starts")
        if DC in fixed:
            fixed[DC] = told(result, (self,))
        starts = StartSummary(len(found.runs), found.near(_SAME))
        if self.law is not None:
            result = replace(result, freedom=self.law.freedom(result))
        elif (law := noise_law(result, self.abscissa, self.spectrum.modulus)) is not None:
            return replace(self, law=law).individual(kind, held, progress, seed)
        return IndividualFit(self, model, with_starts(result, starts), fixed, unfelt)

    def open_path(self) -> float:
        return OPEN * float(self.spectrum.modulus.max())

    def _without_open_path(
        self, problem: Problem, model: PortModel, x: Array, found: Search, random: np.random.Generator
    ) -> tuple[Problem, Array, Search, dict[str, str]]:
        """Return the problem, coordinates and search with Rdc fixed at an open circuit, if the data do not show Rdc."""
        closed = problem.holding(DC, INFINITE)
        at = problem.labels.index(DC)
        # Rdc must improve the BIC on independent readings
        residuals = problem.predictions(x[None])[0] - problem.data
        readings, independent = len(residuals), problem.observations[0].independent_samples(residuals)
        best = found.best.sum_of_squares
        doubtful = self._lonely_errors(problem, x, best)[at] * np.sqrt(readings / independent) > DETERMINED

        def gain(other: float) -> float:
            return float(independent * np.log(max(other, 1e-300) / max(best, 1e-300)) - np.log(independent))

        if not doubtful:  # a rough search is enough where the open path is far from the data
            rough = self._search(closed, model, deepcopy(random), np.delete(x, at), rough=True)
            if gain(rough.best.sum_of_squares / _SURPRISE) >= 0:
                return problem, x, found, {}
        without = self._search(closed, model, random, np.delete(x, at))
        if gain(without.best.sum_of_squares) >= 0 and not doubtful:
            return problem, x, found, {}
        x = _within(closed, without.best.parameters)
        return closed, x, without, {DC: OPEN_PATH}

    def _lonely_errors(self, problem: Problem, x: Array, squares: float) -> Array:
        """Return the standard error (n,) of every coordinate with all others held, a lower limit of the true error."""
        slopes = problem.derivatives(x)[1]
        size = np.linalg.norm(np.where(np.isfinite(slopes), slopes, 0.0), axis=0)
        deviation = np.sqrt(squares / max(len(self.data) - len(x), 1)) + 1e-9
        with np.errstate(divide="ignore"):
            return deviation / size

    def _search(
        self,
        problem: Problem,
        model: PortModel,
        random: np.random.Generator,
        near: Array | None = None,
        *,
        rough: bool = False,
    ) -> Search:
        """Return descents from starts derived from the data, and from ``near``; ``rough`` ones are not continued."""
        kind, held = model.kind, model.held or 0.0
        omega = 2 * np.pi * self.spectrum.frequency

        def residuals(x: Array) -> Array:
            return problem.predictions(_within(problem, x)[None])[0] - problem.data

        def jacobian(x: Array) -> Array:
            return problem.derivatives(_within(problem, x))[1]

        def suggested(count: int) -> list[Array]:
            sets = kind.spectrum_starts(self.spectrum.impedance - held, omega, random)
            sets = sets[:, [kind.names.index(label) for label in problem.labels]]
            x = problem.scales.coordinates(sets)
            left = problem.predictions(x) - problem.data
            finite = np.asarray(np.isfinite(left).all(axis=1))
            squares = np.where(finite, (np.where(np.isfinite(left), left, 0.0) ** 2).sum(axis=1), np.inf)
            best = [part[np.argmin(squares[part])] for part in np.array_split(np.arange(len(x)), count)]
            return [x[k] for k in best if finite[k]]

        def descents(starts: list[Array]) -> Search:
            if rough:
                return search(residuals, jacobian, starts, tolerance=_ROUGH, most=_EVALUATIONS // 3, polishes=0)
            return search(
                residuals, jacobian, starts,
                tolerance=1e-11, rounding=1e-26, most=_EVALUATIONS, polishes=4, rough=_ROUGH,
            )  # fmt: skip

        chosen = ([near] if near is not None else []) + suggested(_FITS)
        if not chosen:
            raise SolveError(f"no start of model {kind.name} gives finite residuals for this spectrum")
        found = descents(chosen)
        if found.near(_SAME) < 2 and not rough:
            around = found.best.parameters + random.uniform(-0.3, 0.3, len(problem.labels))
            found = gather([*found.runs, *descents([*suggested(_MORE_FITS), around]).runs], 1e-26)
        return found


def _within(problem: Problem, x: Array) -> Array:
    """Return coordinates clipped to a range that floating-point numbers resolve."""
    limits = np.where(np.isinf(problem.scales.upper), _RANGE, _LIMITED_RANGE)
    return np.clip(x, -limits, limits)
