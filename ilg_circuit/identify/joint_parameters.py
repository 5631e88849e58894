"""What a joint fit says of the strip: shared and own parameters, their covariance, and what no choice of Re changes."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..fit.estimate import Parameter
from ..fit.intervals import uncertainties
from ..fit.together import Together
from ..strip.actuator import Uncertainty
from ..strip.port import Port
from .datasets import ANY_LADDER, PortModel
from .identification import COUPLING_UNITS, uncertainty_of
from .joint_current import JointCurrent
from .joint_displacement import JointDisplacement

Array = NDArray[np.float64]

_STEP = 1e-4


def uncertainty_together(model: str, fits: Sequence[Together], moved: JointDisplacement | None) -> Uncertainty:
    """The covariance of the logarithms of the strip's parameters; own ones are averaged."""
    single = [moved.own[0].fit] if moved is not None and moved.together is None else []
    everything = uncertainty_of(model, [together.fit for together in fits] + single)
    names = [name for together in fits for name in together.parameters.names]
    names += [name for fit in single for name in fit.names]
    size = len(everything.names)
    matrix, row, column = np.zeros((len(names), size)), 0, 0
    for block in [together.averaging for together in fits] + [np.eye(len(fit.names)) for fit in single]:
        matrix[row : row + block.shape[0], column : column + block.shape[1]] = block
        row, column = row + block.shape[0], column + block.shape[1]
    covariance = matrix @ np.array(everything.covariance) @ matrix.T
    covariance = (covariance + covariance.T) / 2
    return Uncertainty(model, tuple(names), tuple(map(tuple, covariance.tolist())))


def parameters_together(
    found: JointCurrent, fits: Sequence[Together], moved: JointDisplacement | None, uncertainty: Uncertainty
) -> tuple[dict[str, Parameter], dict[str, dict[str, Parameter]]]:
    """The strip's parameters, and by record those that it has for itself."""
    units = found.model.units | COUPLING_UNITS
    errors = dict(zip(uncertainty.names, np.sqrt(np.diag(np.array(uncertainty.covariance))).tolist(), strict=True))
    parameters: dict[str, Parameter] = {}
    own: dict[str, dict[str, Parameter]] = {}
    for together in fits:
        shared = uncertainties(together.fit, {n: units[n.split("[")[0]] for n in together.fit.names}).parameters
        for name, value in zip(together.parameters.names, together.mean.tolist(), strict=True):
            if name not in together.parameters.own:
                parameters[name] = shared[name]
                continue
            parameters[name] = _by_logarithm(value, units[name], errors[name])
            for part in together.parts:
                own.setdefault(part.source, {})[name] = shared[f"{name}[{part.source}]"]
    if found.model.held is not None:
        parameters["electrode_resistance"] = Parameter(found.model.held, "ohm", held=_held(found.model, found.port))
    if moved is not None and moved.together is None:
        parameters |= uncertainties(moved.own[0].fit, COUPLING_UNITS).parameters
    return parameters, own


def _by_logarithm(value: float, unit: str, relative: float) -> Parameter:
    """A parameter whose logarithm has the standard error ``relative``."""
    factor = math.exp(1.96 * relative)
    return Parameter(value, unit, value * relative, (value / factor, value * factor))


def _held(model: PortModel, port: Port) -> str:
    """Why Re was not fitted, and how far that matters."""
    how = "held at the value given" if model.held else "held at zero, since nothing else is known of the electrodes"
    if not model.kind.linear:
        return f"not fitted: {how} (--electrode-resistance fit frees it)"
    limit = high_frequency_resistance(port)
    return f"no current or spectrum of a linear port fixes it (any Re below {limit:.4g} ohm fits as well): {how}"


def high_frequency_resistance(port: Port) -> float:
    """Resistance [ohm] of the port near 0 V as the frequency goes to infinity."""
    ions = port.series_resistance if port.ladder is not None else 1 / sum(1 / r for r, _ in port.branches)
    return port.electrode_resistance + 1 / (1 / port.dc_resistance + 1 / ions)


def derived_quantities(found: JointCurrent, uncertainty: Uncertainty) -> dict[str, Parameter]:
    """The port's resistance at both ends of the spectrum, which the data fix whatever Re is, and time constants."""
    logs = np.log(found.together.mean)
    n = len(logs)
    covariance = np.array(uncertainty.covariance)[:n, :n]

    def ends(logs: Array) -> Array:
        port = found.model.port(np.exp(logs), ANY_LADDER)
        return np.log([port.dc_resistance + port.electrode_resistance, high_frequency_resistance(port)])

    slopes = np.array([(ends(logs + step) - ends(logs - step)) / (2 * _STEP) for step in _STEP * np.eye(n)])
    errors = np.sqrt(np.diag(slopes.T @ covariance @ slopes))
    names = ("steady_resistance", "high_frequency_resistance")
    derived = {
        name: _by_logarithm(value, "ohm", error)
        for name, value, error in zip(names, np.exp(ends(logs)).tolist(), errors.tolist(), strict=True)
    }
    for k, (r, c) in enumerate(found.port.branches, 1):
        ending = f"_{k}" if len(found.port.branches) > 1 else ""
        derived[f"time_constant{ending}"] = Parameter(r * c, "s")
    return derived
