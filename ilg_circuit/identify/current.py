"""The electrical fit: any model of the port to a measured current."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..circuit.strip import port_netlist
from ..drive import PiecewiseLinear
from ..errors import InputError
from ..fit.identifiability import Identifiability, diagnose
from ..fit.least_squares import Fit, fit_problem
from ..fit.problem import Problem, Scales
from ..fit.residuals import effective_samples, information_criterion, structured
from ..measurements.prepare import Measurement, noise_level
from ..simulation.response import transient_band
from ..solve.transient import DEFAULT_ACCURACY, transient
from ..strip.models import ElectricalModel, Ladders, electrical_model
from ..strip.port import Port
from ..units import format_quantity
from .modal import Ports, modal_model
from .scout import Scouting, fit_from_several, scout
from .start import model_start

Array = NDArray[np.float64]

#: Error of a nonlinear model's transient in a fit, relative to the largest current.
_NONLINEAR_ACCURACY = 1e-6
#: Steps whose voltages differ by less than this part tell nothing about a nonlinearity.
_SAME_VOLTAGE = 0.2
#: Residuals below this part of the peak are of no interest, whatever their structure.
_NEGLIGIBLE = 1e-4


@dataclass(frozen=True)
class CurrentFit:
    """Fit of one electrical model. ``time`` [s] since the onset, ``data`` and ``fitted`` [A], all (samples,).

    ``port`` is what was fitted, R-C branches by ascending time constant; ``offset`` [A] is the instrument's, where one
    was found at rest; ``scouting`` tells from how many starts, ``identifiability`` which parameters the data determine.
    """

    model: str
    fit: Fit
    port: Port
    time: Array
    data: Array
    offset: float | None
    scouting: Scouting
    identifiability: Identifiability
    warnings: tuple[str, ...]

    @property
    def unreliable(self) -> str:
        """Why the fit should not be chosen; empty where nothing speaks against it."""
        return self.identifiability.reason or self.scouting.doubt

    @property
    def fitted(self) -> Array:
        return self.data - self.fit.residuals

    @property
    def dc_resistance(self) -> float:
        """Rdc [ohm]."""
        return self.port.dc_resistance

    @property
    def branches(self) -> tuple[tuple[float, float], ...]:
        """(resistance [ohm], capacitance [F]) by ascending time constant; none where the ions diffuse."""
        return self.port.branches

    def effective_bic(self, simplest: CurrentFit) -> float:
        """BIC on as many samples as are independent, by the better model's residuals; see `residuals`."""
        samples = max(effective_samples(self.fit.residuals), effective_samples(simplest.fit.residuals))
        return information_criterion(self.fit.residuals, self.fit.count, samples)


def fit_current(
    measurement: Measurement,
    electrode_resistance: float,
    model: str,
    engine: str = "ngspice",
    progress: Callable[[], None] | None = None,
) -> CurrentFit:
    """Fit ``model``, any of `ilg_circuit.strip.models`, to the measured current, Re held [ohm].

    Raises InputError or SolveError as `identify` says.
    """
    kind = electrical_model(model)
    require_voltages(kind, [measurement])
    channel, drive = measurement.current, measurement.drive
    rest = channel.rest
    offset = rest_offset(channel.values[rest])
    keep = np.ones(len(rest), dtype=bool) if offset is not None else ~rest
    t, data = channel.time[keep], channel.values[keep]
    after = t >= 0
    start = model_start(kind, t[after], data[after] - (offset or 0.0), drive, electrode_resistance)
    nuisance = np.ones((len(t), int(offset is not None)))
    scales = Scales(np.array([p.upper for p in kind.parameters]))

    def problem(ladders: Ladders) -> tuple[Problem, Ports]:
        def ports(values: Array) -> list[Port]:
            return [kind.port(v, electrode_resistance, ladders) for v in values.tolist()]

        return Problem(lambda v: currents(ports(v), drive, t, engine), data, kind.names, scales, nuisance), ports

    ladders = ladders_for(kind, start, t[after])
    if kind.linear:
        scouting, check = scout(*problem(ladders), drive, t, start)
        ladders = ladders_for(kind, scouting.values, t[after])
        whole, ports = problem(ladders)
        # the closed form of all samples leaves little to do for the engine, and serves whoever moves the parameters
        quick = replace(whole, model=modal_model(ports, drive, t))
        fit = fit_problem(whole, fit_problem(quick, scouting.values).values, progress)
        check(fit.values)
        fit = replace(fit, problem=quick)
    else:
        scouting, fit = fit_from_several(problem(ladders)[0], start, progress)
    fit = in_order(fit, model)
    found = kind.port(fit.values.tolist(), electrode_resistance, ladders)
    identifiability = diagnose(fit, found.branches)
    warnings = [*_warnings(model, fit, data), *_resolution_warnings(fit, data)]
    if scouting.doubt:
        warnings.append(f"{scouting.doubt}: it may not be the least")
    if not identifiability.determined:
        warnings.append(f"not determined by these data ({identifiability.reason})")
    return CurrentFit(
        model=model,
        fit=fit,
        port=found,
        time=t,
        data=data,
        offset=float(fit.nuisance[0]) if offset is not None else None,
        scouting=scouting,
        identifiability=identifiability,
        warnings=tuple(warnings),
    )


def require_voltages(model: ElectricalModel, measurements: Sequence[Measurement]) -> None:
    """Raise InputError where steps of one voltage are all that a sinh electron path is to be fitted to.

    Under a constant voltage it is a resistor, whichever its emission voltage.
    """
    steps = [abs(m.step) for m in measurements if m.step is not None]
    if not model.constant_voltage_hides or len(steps) < len(measurements):
        return
    if max(steps) < (1 + _SAME_VOLTAGE) * min(steps):
        raise InputError(
            f"model {model.name} needs several voltages: under a step of {max(steps):.3g} V alone its electron path is "
            "a resistor; give files of different voltages, a waveform, or another model"
        )


def currents(ports: Sequence[Port], drive: PiecewiseLinear, t: Array, engine: str) -> Array:
    """Currents [A] (ports, samples) into ``ports`` of one model at ``t`` [s]; zero before the onset at 0."""
    after = t >= 0
    result = np.zeros((len(ports), len(t)))
    linear = ports[0].linear
    accuracy = DEFAULT_ACCURACY if linear else _NONLINEAR_ACCURACY
    acceptable = accuracy if linear else 10 * accuracy
    netlists = [port_netlist(port) for port in ports]
    found = transient(netlists, drive, t[after], engine=engine, accuracy=accuracy, acceptable=acceptable)
    result[:, after] = found.values[:, 0]
    return result


def ladders_for(model: ElectricalModel, start: Array, t: Array) -> Ladders:
    """Ladders that stay the same but for their scale while a fit moves their parameters."""
    return model.ladders(start, transient_band(t))


def rest_offset(rest: Array) -> float | None:
    """Mean current at rest, where it is beyond chance; None otherwise."""
    if len(rest) < 5:
        return None
    mean, spread = float(rest.mean()), float(rest.std(ddof=1))
    return mean if abs(mean) > 4 * spread / np.sqrt(len(rest)) and mean else None


def in_order(fit: Fit, model: str) -> Fit:
    """The fit with its branches by ascending time constant (a sum of branches is unique up to their order)."""
    index = electrical_model(model).order(fit.values)
    everything = np.concatenate([index, np.arange(len(index), fit.count)])
    return replace(
        fit,
        values=fit.values[index],
        errors=fit.errors[index],
        covariance=fit.covariance[np.ix_(everything, everything)],
        slopes=fit.slopes[:, everything],
    )


def _warnings(model: str, fit: Fit, data: Array) -> tuple[str, ...]:
    found = []
    peak = float(np.abs(data).max())
    if structured(fit.residuals) and fit.rmse > max(1.5 * noise_level(data), _NEGLIGIBLE * peak):
        share = f"{fit.rmse / peak:.1%} of the peak current rms"
        if model == "rc":
            found.append(f"one pole is not enough: the residuals ({share}) have a structure; try --model rc2")
        else:
            what = "two branches do" if model == "rc2" else f"model {model} does"
            found.append(f"the residuals ({share}) still have a structure that {what} not hold")
        found.append(
            "residuals of neighbouring samples are alike: standard errors that take them as independent are too small, "
            "those of a block bootstrap are given"
        )
    return tuple(found)


def _resolution_warnings(fit: Fit, data: Array) -> list[str]:
    """What a coarse instrument leaves open beyond the standard errors."""
    found = []
    steps = np.diff(np.unique(data))
    if len(steps) and float(steps.min()) > 2 * fit.rmse and len(steps) < len(data) / 4:
        found.append(
            f"the current's resolution of {format_quantity(float(steps.min()), 'A', 2)} is coarser than the residuals: "
            "what lies below it, such as the steady current, is not known as well as the standard errors say"
        )
    return found
