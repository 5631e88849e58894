"""The resistance along a strip's electrodes, from its shape at several marks.

Contact at the clamp, far end open, small signal: the voltage at x falls as cosh(gamma (L - x))/cosh(gamma L), with
gamma^2 = r y of the sheets' resistance r [ohm/m], there and back, and the admittance y [S/m] of a length of strip, and
the free curvature with it. The shape so gives (gamma L)^2, the product of r and y; r alone where y is known from the
strip's port. At rest under a constant voltage y is that of the electron path, and deflections may be large: x and y of
the marks are fitted. Under a sine the complex amplitudes of y are, for small deflections.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
from numpy.polynomial.legendre import leggauss

from ..arrays import Array, ComplexArray, plain
from ..errors import InputError, argument
from ..findings import Finding, Warned
from ..fit.curve import fit_curve
from ..fit.estimate import Estimate, Estimated
from ..fit.result import FitResult
from ..measurements.marks import Marks
from ..result import Column, Result
from ..strip.actuator import Actuator
from ..strip.elements import lumped_elements

#: Part of a record, its end, over which a strip at rest is averaged.
_REST = 0.1
#: Below this abs(gamma L) series take the place of differences.
_SERIES = 1e-2
#: Readings of a sine for each mark, and periods, at least.
_FEWEST, _PERIODS = 8, 1.0
#: Part of the free length by which a mark may seem to lie beyond its end.
_BEYOND = 0.02
#: Part of the free length by which small deflections may be large.
_LARGE = 0.2


@dataclass(frozen=True, repr=False, eq=False)
class ShapeFit(Warned, Estimated, Result):
    """The resistance along a strip from its shape, as `ilg_circuit.identify_shape` returns it.

    Attributes
    ----------
    fit : FitResult
        The fit; ``shape_fit["sheet_resistance"]`` is an estimate with its unit.
    strip : str
        Name of the strip.
    frequency : float or None
        Frequency of the drive [Hz]; None for a strip at rest.
    places : ndarray (m,)
        Distances of the marks from the clamp [m].
    measured, fitted : ndarray (m,), complex
        Positions x + i y of the marks at rest, or amplitudes of y under a sine [m].
    gamma_length : complex
        gamma L of the free length; its square is r y L^2.
    warnings : tuple of str
        Findings as sentences.
    """

    presenter: ClassVar[str] = "shape_fit"

    fit: FitResult
    strip: str
    frequency: float | None
    places: Array
    measured: ComplexArray
    fitted: ComplexArray
    gamma_length: complex
    findings: tuple[Finding, ...] = ()

    def estimate_tables(self) -> Mapping[str, Mapping[str, Estimate]]:
        """Return the fitted parameters with their units."""
        units = {"sheet_resistance": "ohm"} | dict.fromkeys(("curvature", "curvature_re", "curvature_im"), "1/m")
        found = self.fit.estimates.items()
        return {"parameter": {name: replace(e, unit=units.get(name, "")) for name, e in found}}

    def table(self) -> tuple[Column, ...]:
        """Return one row per estimate."""
        return Estimated.table(self)

    def to_dict(self) -> dict[str, Any]:
        """Return estimates, gamma L, and the marks with their fit as plain data."""
        parts = {"measured": self.measured, "fitted": self.fitted}
        return {
            "strip": self.strip,
            "frequency_Hz": self.frequency,
            "parameters": {name: e.to_dict() for name, e in self.estimate_tables()["parameter"].items()},
            "gamma_length": [self.gamma_length.real, self.gamma_length.imag],
            "places_m": plain(self.places),
            **{f"{what}_{part}_m": plain(getattr(z, part)) for what, z in parts.items() for part in ("real", "imag")},
            "warnings": list(self.warnings),
        }


def identify_shape(
    marks: Marks,
    strip: Actuator,
    *,
    frequency: float | None = None,
    places: Array | None = None,
    port: bool = True,
) -> ShapeFit:
    """Return the fit of a shape; ``places`` [m] (m,) are the marks' distances from the clamp, or else their x at rest.

    ``frequency`` [Hz] is that of a sine; None for a strip at rest. With ``port`` the strip's own gives the sheets'
    resistance per square, both sheets added; without it (gamma L)^2 is fitted. Raises InputError for marks that do not
    fit the strip, SolveError where they do not determine the parameters.
    """
    length = strip.geometry.free_length
    rest = [_rest(*track) for track in zip(marks.times, marks.x, marks.y, strict=True)]
    at = np.real(rest) if places is None else places
    if at.shape != (len(marks),):
        raise InputError(f"{argument('places')}: {len(at)} distances for {len(marks)} marks; give one for each")
    outside = ~((at > 0) & (at <= length * (1 + _BEYOND)))
    if outside.any():
        wrong = at[outside][0]
        raise InputError(
            f"a mark is {wrong:.4g} m from the clamp, the free length is {length:.4g} m: give positions from "
            f"the clamp, with x along the strip at rest, or {argument('places')}"
        )
    at = np.minimum(at, length)
    admittance = _admittance(strip, frequency)
    measured = _at_end(marks, rest, at) if frequency is None else _amplitudes(marks, frequency)
    unit = admittance * length**2 / strip.geometry.width  # of (gamma L)^2 in ohm per square
    model, start, names = _model(length, frequency, unit if port else None)
    guess = measured[np.argmax(at)].imag if frequency is None else measured[np.argmax(at)]
    bend = 2 * guess / at.max() ** 2
    first = [bend] if frequency is None else [bend.real, bend.imag]
    fit = fit_curve(model, at, measured, [*np.real(first), *start], names=names)
    values = fit.values.tolist()
    square = complex(values[-1] * unit) if port else complex(*values[len(first) :])
    fitted = np.asarray(model(at, *values))
    findings = [] if not port else _on_resistance(fit, strip)
    if frequency is not None and np.abs(measured).max() > _LARGE * length:
        findings.append(Finding("shape-not-small", values={"part": float(np.abs(measured).max() / length)}))
    return ShapeFit(fit, strip.name, frequency, at, measured, fitted, complex(np.sqrt(square)), tuple(findings))


def curved_line(places: Array, length: float, square: complex) -> ComplexArray:
    """Return y at ``places`` [m] (m,) for a free curvature of 1/m at the clamp, small deflections; (gamma L)^2."""
    x, g = places / length, np.sqrt(complex(square))
    if abs(g) < _SERIES:  # to g^2: curvature 1 + g^2 ((1 - x)^2 - 1)/2
        return np.asarray(length**2 * (x**2 / 2 + square * (x**4 / 24 - x**3 / 6)))
    # scaled by exp(-g), so that nothing overflows; g has a positive real part
    far = (np.exp(-g * x) + np.exp(-g * (2 - x))) / (1 + np.exp(-2 * g))
    return np.asarray(length**2 * (far - 1 + g * x * np.tanh(g)) / g**2)


def bent_line(places: Array, length: float, bend: float, square: float) -> ComplexArray:
    """Return x + i y at ``places`` [m] (m,) of any deflection, for the curvature ``bend`` [1/m] at the clamp."""
    nodes, weights = leggauss(8)
    marks = np.union1d(np.linspace(0.0, length, 25), places)
    size = np.diff(marks)[:, None]
    s = marks[:-1, None] + size * (nodes + 1) / 2
    g = np.sqrt(complex(square))
    x = s / length
    if abs(g) < _SERIES:
        turn = x + square * (x**3 / 6 - x**2 / 2)
    else:
        turn = (np.tanh(g) - (np.exp(-g * x) - np.exp(-g * (2 - x))) / (1 + np.exp(-2 * g))) / g
    steps = (np.exp(1j * bend * length * np.real(turn)) * size * weights / 2).sum(axis=1)
    return np.concatenate([[0.0], np.cumsum(steps)])[np.searchsorted(marks, places)]


def _model(
    length: float, frequency: float | None, unit: complex | None
) -> tuple[Callable[..., ComplexArray], list[float], tuple[str, ...]]:
    """Return the model of the marks by its parameters, the start of those after the curvature, and all names."""
    if frequency is None:
        factor = 1.0 if unit is None else unit.real
        name = "gamma_length_squared" if unit is None else "sheet_resistance"
        return (lambda s, bend, r: bent_line(s, length, bend, r * factor)), [0.5 / factor], ("curvature", name)
    curvature = ("curvature_re", "curvature_im")
    if unit is not None:
        known = unit
        return (
            lambda s, a, b, r: complex(a, b) * curved_line(s, length, r * known),
            [0.5 / abs(known)],
            (*curvature, "sheet_resistance"),
        )
    return (
        lambda s, a, b, p, q: complex(a, b) * curved_line(s, length, complex(p, q)),
        [0.5, 0.1],
        (*curvature, "gamma_length_squared_re", "gamma_length_squared_im"),
    )


def _admittance(strip: Actuator, frequency: float | None) -> complex:
    """Return the admittance of a length of strip [S/m] without the resistance of its electrodes."""
    port = replace(lumped_elements(strip).port, electrode_resistance=0.0, inductance=0.0)
    if frequency is None:
        return 1 / port.dc_resistance / strip.geometry.length
    if not (np.isfinite(frequency) and frequency > 0):
        raise InputError(f"{argument('frequency')} is {frequency:g} Hz; it must be more than zero")
    return complex(1 / port.impedance(np.array([2j * np.pi * frequency]))[0]) / strip.geometry.length


def _rest(t: Array, x: Array, y: Array) -> complex:
    """Return the mean position x + i y of a mark before the drive begins: until t = 0, or at the first reading."""
    first = t <= max(t[0], 0.0)
    return complex(x[first].mean(), y[first].mean())


def _at_end(marks: Marks, rest: list[complex], at: Array) -> ComplexArray:
    """Return the mean positions of the marks at the end, as if they had been on the straight strip: x + i y (m,)."""
    ends = []
    for t, x, y in zip(marks.times, marks.x, marks.y, strict=True):
        last = t >= t[-1] - _REST * (t[-1] - t[0])
        ends.append(complex(x[last].mean(), y[last].mean()))
    return np.array(ends) - rest + at


def _amplitudes(marks: Marks, frequency: float) -> ComplexArray:
    """Return the complex amplitudes of the marks' y (m,), that of cos(2 pi f t) being real."""
    found = []
    for t, y in zip(marks.times, marks.y, strict=True):
        if len(t) < _FEWEST or t[-1] - t[0] < _PERIODS / frequency * (1 - 1e-6):
            raise InputError(
                f"{marks.source}: {len(t)} readings over {t[-1] - t[0]:g} s do not show a sine of {frequency:g} Hz; "
                f"at least {_FEWEST} over a period are needed"
            )
        phase = 2 * np.pi * frequency * t
        columns = np.stack([np.cos(phase), np.sin(phase), np.ones_like(t), t - t.mean()], axis=1)
        a, b, *_ = np.linalg.lstsq(columns, y, rcond=None)[0]
        found.append(complex(a, -b))
    return np.array(found)


def _on_resistance(fit: FitResult, strip: Actuator) -> list[Finding]:
    """Return findings on a resistance that cannot be told from zero, and on a port that is not fitted."""
    estimate = fit.estimates["sheet_resistance"]
    found = []
    if estimate.interval is not None and estimate.interval[0] <= 0:
        found.append(Finding("sheet-resistance-not-seen", values={"most": estimate.interval[1]}))
    if strip.uncertainty is None:
        found.append(Finding("sheet-resistance-by-port", values={"strip": strip.name}))
    return found
