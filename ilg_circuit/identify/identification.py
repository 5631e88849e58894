"""A measurement -> the strip: current first, then displacement, each fitted with the ngspice transient in the loop."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError, SolveError
from ..fit.bootstrap import block_bootstrap, correlated
from ..fit.estimate import Parameter
from ..fit.intervals import require_method, uncertainties
from ..fit.least_squares import Fit
from ..fit.residuals import ResidualWindow, residual_windows
from ..measurements.record import Record
from ..simulation import closed_forms as formulas
from ..strip.actuator import PAPER, Actuator, Coupling, Uncertainty
from ..strip.elements import lumped_elements
from ..strip.models import electrical_model
from ..units import format_quantity
from .current import CurrentFit, fit_current
from .displacement import DisplacementFit, fit_displacement
from .displacement_metrics import DisplacementFigures, displacement_figures
from .selection import Candidate, choose, scouting_engine, single

Array = NDArray[np.float64]

COUPLING_UNITS = {
    "coupling_gain": "m/(V s)",
    "coupling_zero": "1/s",
    "coupling_damping_ratio": "",
    "coupling_natural_frequency": "rad/s",
}


@dataclass(frozen=True)
class Identification:
    """What a measurement says of a strip. ``actuator`` has the fitted circuit and, if one was fitted, the coupling."""

    model: str
    measurement: Record
    actuator: Actuator
    parameters: dict[str, Parameter]
    derived: dict[str, Parameter]
    statistics: dict[str, Any]
    correlations: dict[str, Any]
    warnings: tuple[str, ...]
    current: CurrentFit
    displacement: DisplacementFit | None
    engine: str
    candidates: tuple[Candidate, ...] = field(default=())

    @property
    def figures(self) -> DisplacementFigures | None:
        """Peak, overshoot, settling, back-relaxation; None without a displacement or a constant voltage at first."""
        return displacement_figures(self.displacement, self.measurement.drive) if self.displacement else None

    @property
    def residual_windows(self) -> dict[str, tuple[ResidualWindow, ...]]:
        """Of current [A] and displacement [m], the latter as far as it was fitted."""
        last = float(self.current.time[-1])
        windows = {"current": residual_windows(self.current.time, self.current.fit.residuals, last)}
        if self.displacement is not None:
            t = self.displacement.channel.until(self.displacement.window).time
            windows["displacement"] = residual_windows(t, self.displacement.fit.residuals, last)
        return windows

    def to_json(self) -> dict[str, Any]:
        """The contract's fit.json: model, parameters, derived, statistics, correlations, warnings."""
        figures = self.figures
        return {
            "model": self.model,
            "source": self.measurement.source,
            "engine": self.engine,
            "parameters": {name: p.to_json() for name, p in self.parameters.items()},
            "derived": {name: p.to_json() for name, p in self.derived.items()},
            "statistics": self.statistics,
            "residual_windows": {name: [w.to_json() for w in rows] for name, rows in self.residual_windows.items()},
            "displacement": {"figures": figures.to_json() if figures else None},
            "correlations": self.correlations,
            "candidates": [c.to_json() for c in self.candidates],
            "warnings": list(self.warnings),
        }


def identify(
    measurement: Record,
    *,
    base: Actuator | None = None,
    model: str = "auto",
    electrode_resistance: float | None = None,
    engine: str = "ngspice",
    intervals: str = "covariance",
    progress: Callable[[], None] | None = None,
) -> Identification:
    """Fit the current by ``model`` (of `strip.models`, or auto: see `selection`), then the displacement by d(s).

    ``base`` gives geometry, E and density (default: the paper's, with a warning); ``electrode_resistance`` [ohm] is
    held, because a step fixes only three of the four elements: default is the base's; ``intervals`` is the method of
    the 95 % intervals, see `intervals`. Raises InputError for data that hold no answer, SolveError for a fit that does
    not converge.
    """
    method = require_method(intervals)
    if model != "auto":
        electrical_model(model)
    strip = base or PAPER
    held = lumped_elements(strip).electrode_resistance if electrode_resistance is None else electrode_resistance
    require_electrode_resistance(held, measurement)
    warnings = list(map(str, measurement.notes))

    def fit(measurement: Record, held: float, model: str) -> CurrentFit:
        return fit_current(measurement, held, model, engine, progress)

    def scout(measurement: Record, held: float, model: str) -> CurrentFit:
        return fit_current(measurement, held, model, scouting_engine(measurement, model, engine), progress)

    if model == "auto":
        current, candidates = choose(measurement, held, scout, warnings)
        if scouting_engine(measurement, current.model, engine) != engine:
            current = fit(measurement, held, current.model)
            candidates = tuple(replace(c, fit=current) if c.chosen else c for c in candidates)
    else:
        current, candidates = single(measurement, held, model, fit)
    warnings += current.warnings
    fitted = Actuator.from_port(
        strip.geometry,
        current.port,
        base=strip.material,
        coupling=None,
        mounting=strip.mounting,
        name=measurement.source.rsplit(".", 1)[0],
    )
    displacement = None
    if measurement.displacement is not None:
        try:
            displacement = fit_displacement(measurement, fitted, engine, progress)
        except (InputError, SolveError) as error:
            warnings.append(f"no displacement fit: {error}")
    if displacement is not None:
        fitted = _with_coupling(fitted, displacement.coupling)
        warnings += displacement.warnings
    elif base is not None and base.coupling is not None:
        fitted = _with_coupling(fitted, base.coupling)
        warnings.append("the coupling was not fitted: it is that of the given actuator")
    if base is None and displacement is not None:
        warnings.append(
            "no --actuator given: geometry and Young's modulus are the paper's; resistances and capacitances do not "
            "depend on them, the coupling gain is in proportion to b^2/L_F^2"
        )
    fits = [current.fit] + ([displacement.fit] if displacement is not None else [])
    fitted = replace(fitted, uncertainty=uncertainty_of(current.model, fits))
    units = {p.name: p.unit for p in electrical_model(current.model).parameters}
    found = {"current": uncertainties(current.fit, units, method, progress)}
    if displacement is not None:
        found["displacement"] = uncertainties(displacement.fit, COUPLING_UNITS, method, progress)
    warnings += [line for each in found.values() for line in each.warnings]
    parameters = found["current"].parameters | {"electrode_resistance": _held(held)}
    if displacement is not None:
        parameters |= found["displacement"].parameters
    statistics = _statistics(measurement, current, displacement)
    details = {name: each.details for name, each in found.items() if each.details is not None}
    return Identification(
        model=current.model,
        measurement=measurement,
        actuator=fitted,
        parameters=parameters,
        derived=_derived(current, held, measurement, displacement),
        statistics=statistics | ({"intervals": details} if details else {}),
        correlations=_correlations(current, displacement),
        warnings=tuple(dict.fromkeys(warnings)),
        current=current,
        displacement=displacement,
        engine=engine,
        candidates=candidates,
    )


def _with_coupling(actuator: Actuator, coupling: Coupling) -> Actuator:
    return replace(actuator, coupling=coupling)


def uncertainty_of(model: str, fits: list[Fit]) -> Uncertainty:
    """The covariances of the fits, which share no data, as one of all parameters' logarithms."""
    values = np.concatenate([fit.values for fit in fits])
    covariance = np.zeros((len(values), len(values)))
    start = 0
    for fit in fits:
        n = len(fit.values)
        # where neighbouring residuals are alike the bootstrap's is the honest one
        honest = block_bootstrap(fit).covariance if correlated(fit) else fit.covariance[:n, :n]
        covariance[start : start + n, start : start + n] = honest
        start += n
    relative = covariance / np.outer(values, values)
    relative = (relative + relative.T) / 2  # symmetric to the last digit
    return Uncertainty(model, tuple(name for fit in fits for name in fit.names), tuple(map(tuple, relative.tolist())))


def require_electrode_resistance(held: float, measurement: Record) -> None:
    """Raise InputError for an Re ``held`` [ohm] below zero, or that leaves the peak current no voltage."""
    if not (math.isfinite(held) and held >= 0):
        raise InputError(f"electrode resistance {held:g} ohm must be zero or more")
    after = measurement.current.time >= 0
    i, u = measurement.current.values[after], measurement.drive.value(measurement.current.time[after])
    k = int(np.argmax(np.abs(i)))
    if held and held * abs(i[k]) >= abs(u[k]):
        raise InputError(
            f"electrode resistance {held:g} ohm is too large: the peak current of {format_quantity(abs(i[k]), 'A', 4)} "
            f"allows less than {abs(u[k] / i[k]):.4g} ohm"
        )


def _held(held: float) -> Parameter:
    how = "held at the value given" if held else "held at zero, since nothing else is known of the electrodes"
    return Parameter(held, "ohm", held=f"a step fixes three of four elements: {how}")


def _derived(
    current: CurrentFit, held: float, measurement: Record, displacement: DisplacementFit | None
) -> dict[str, Parameter]:
    """Quantities computed from the fit; per-volt answers do not depend on what was held or assumed."""
    derived: dict[str, Parameter] = {"onset": Parameter(measurement.onset, "s")}
    if measurement.step is not None:
        derived["step_voltage"] = Parameter(measurement.step, "V")
    if current.model == "rc":
        (pair,) = current.branches
        a0, a1, rate = formulas.current_constants(current.dc_resistance, *pair, held)
        derived |= {
            "steady_conductance": Parameter(a0, "S"),
            "transient_conductance": Parameter(a1, "S"),
            "rate": Parameter(rate, "1/s"),
        }
    for k, (r, c) in enumerate(current.branches, 1):
        ending = f"_{k}" if len(current.branches) > 1 else ""
        derived[f"time_constant{ending}"] = Parameter(r * c, "s")
    if current.offset is not None:
        derived["current_offset"] = Parameter(current.offset, "A")
    if displacement is not None:
        derived |= {
            "rest_position": Parameter(displacement.rest, "m"),
            "displacement_per_volt": Parameter(displacement.per_volt, "m/V"),
            "displacement_window": Parameter(displacement.window, "s"),
        }
        if displacement.drift is not None:
            derived["displacement_drift"] = Parameter(displacement.drift, "m/s")
    return derived


def _statistics(measurement: Record, current: CurrentFit, displacement: DisplacementFit | None) -> dict[str, Any]:
    """Of the current fit; "displacement" holds those of the displacement fit."""
    peak = float(np.abs(current.data).max())
    statistics: dict[str, Any] = {
        "rmse": current.fit.rmse,
        "rmse_unit": "A",
        "rmse_over_peak": current.fit.rmse / peak,
        "aic": current.fit.aic,
        "bic": current.fit.bic,
        "n": len(current.data),
        "evaluations": current.fit.evaluations,
        "starts": current.scouting.starts,
        "starts_agreeing": current.scouting.agreeing,
        "relative_offset": current.fit.offset,
        "identifiability": current.identifiability.to_json(),
    }
    if displacement is not None:
        statistics["displacement"] = {
            "rmse": displacement.fit.rmse,
            "rmse_unit": "m",
            "aic": displacement.fit.aic,
            "bic": displacement.fit.bic,
            "n": len(displacement.fit.residuals),
            "window_s": displacement.window,
            "beam": displacement.beam,
            "evaluations": displacement.fit.evaluations,
            "starts": displacement.scouting.starts,
            "starts_agreeing": displacement.scouting.agreeing,
            "relative_offset": displacement.fit.offset,
        }
    return statistics


def _correlations(current: CurrentFit, displacement: DisplacementFit | None) -> dict[str, Any]:
    fits = [current.fit] + ([displacement.fit] if displacement is not None else [])
    pairs = {}
    for fit in fits:
        matrix = fit.correlations()
        for a in range(len(fit.names)):
            for b in range(a):
                pairs[f"{fit.names[b]}, {fit.names[a]}"] = float(matrix[b, a])
    return pairs
