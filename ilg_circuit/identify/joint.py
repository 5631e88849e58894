"""Several records of one strip fitted together: one port for all of them, an offset of its own for each.

Steps of several voltages and both polarities are what a nonlinear model needs, and what shows whether a linear one
holds. Every record counts in units of what its own fit leaves, so that none drowns another. Each is also predicted from
the others, which were fitted without it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..actuator import PAPER, Actuator
from ..elements import lumped_elements
from ..errors import InputError, SolveError
from ..models import ElectricalModel, electrical_model
from ..port import Port
from ..units import format_quantity
from .current import CurrentFit, currents, fit_current, in_order, ladders_for, require_voltages
from .identification import uncertainty_of
from .intervals import uncertainties
from .least_squares import Fit, fit_circuit
from .measurement import Measurement
from .parameter import Parameter
from .residuals import information_criterion

Array = NDArray[np.float64]

#: A joint fit that leaves so many times what the own fits leave does not hold for all records.
_WORSE = 1.5


@dataclass(frozen=True)
class RecordFit:
    """One record in a joint fit; rms [A] of what three fits leave: its own, the joint one, that of the others.

    ``predicted`` is None where the others could not be fitted.
    """

    source: str
    voltage: float
    time: Array
    data: Array
    fitted: Array
    own: float
    joint: float
    predicted: float | None

    @property
    def peak(self) -> float:
        return float(np.abs(self.data).max())


@dataclass(frozen=True)
class JointFit:
    """Result of `fit_jointly`. ``fit``'s residuals are in units of each record's own; ``actuator`` has the port."""

    model: str
    fit: Fit
    port: Port
    parameters: dict[str, Parameter]
    records: tuple[RecordFit, ...]
    actuator: Actuator
    bic: float
    warnings: tuple[str, ...]

    def to_json(self) -> dict[str, object]:
        """As fit.json of a single record, with a list of records."""
        return {
            "model": self.model,
            "parameters": {name: p.to_json() for name, p in self.parameters.items()},
            "statistics": {"rmse": self.fit.rmse, "bic": self.bic, "n": len(self.fit.residuals)},
            "records": [
                {
                    "source": r.source,
                    "voltage": r.voltage,
                    "rms_own": r.own,
                    "rms_joint": r.joint,
                    "rms_predicted": r.predicted,
                    "peak": r.peak,
                }
                for r in self.records
            ],
            "warnings": list(self.warnings),
        }

    def table(self) -> str:
        """Parameters, then what is left of every record."""
        lines = [f"{len(self.records)} records together, model {self.model}", ""]
        lines.append(f"{'parameter':<28}{'value':>16}{'standard error':>18}")
        for name, p in self.parameters.items():
            error = format_quantity(p.stderr, p.unit, 2) if p.stderr is not None else "held"
            lines.append(f"{name:<28}{format_quantity(p.value, p.unit, 5):>16}{error:>18}")
        lines += ["", f"{'record':<28}{'voltage':>10}{'own fit':>10}{'joint':>10}{'from the others':>18}"]
        for r in self.records:
            predicted = f"{r.predicted / r.peak:.2%}" if r.predicted is not None else "-"
            shares = f"{r.own / r.peak:>10.2%}{r.joint / r.peak:>10.2%}{predicted:>18}"
            lines.append(f"{r.source:<28}{format_quantity(r.voltage, 'V', 4):>10}{shares}")
        lines.append("(rms of the residuals over the record's peak current)")
        return "\n".join(lines)


def fit_jointly(
    measurements: Sequence[Measurement],
    *,
    model: str,
    base: Actuator | None = None,
    electrode_resistance: float | None = None,
    engine: str = "ngspice",
    progress: Callable[[], None] | None = None,
) -> JointFit:
    """Fit ``model`` to the currents of two records or more, Re held [ohm].

    Raises InputError for fewer records, or one that cannot be fitted by itself, SolveError as a single fit does.
    """
    if len(measurements) < 2:
        raise InputError("a joint fit needs two records or more")
    kind = electrical_model(model)
    strip = base or PAPER
    held = lumped_elements(strip).electrode_resistance if electrode_resistance is None else electrode_resistance
    require_voltages(kind, measurements)
    own = [_own(m, held, model, engine, progress) for m in measurements]
    everything = _fit(measurements, own, kind, held, engine, progress)
    fit, port = everything
    records = []
    for k, (m, single) in enumerate(zip(measurements, own, strict=True)):
        fitted = _fitted(m, single, port, engine)
        rest = [j for j in range(len(own)) if j != k]
        predicted = None
        try:
            _, without = _fit([measurements[j] for j in rest], [own[j] for j in rest], kind, held, engine, progress)
            predicted = _rms(single.data - _fitted(m, single, without, engine))
        except (InputError, SolveError):
            predicted = None
        records.append(
            RecordFit(
                m.source,
                m.drive.largest(),
                single.time,
                single.data,
                fitted,
                single.fit.rmse,
                _rms(single.data - fitted),
                predicted,
            )
        )
    units = {p.name: p.unit for p in kind.parameters}
    reason = "not determined by current alone: held" if not held else "held at the value given"
    parameters = uncertainties(fit, units).parameters | {"electrode_resistance": Parameter(held, "ohm", held=reason)}
    actuator = Actuator.from_port(
        strip.geometry,
        port,
        base=strip.material,
        coupling=strip.coupling if base is not None else None,
        mounting=strip.mounting,
        name="joint fit",
        uncertainty=uncertainty_of(model, [fit]),
    )
    return JointFit(
        model=model,
        fit=fit,
        port=port,
        parameters=parameters,
        records=tuple(records),
        actuator=actuator,
        bic=information_criterion(fit.residuals, fit.count, len(fit.residuals)),
        warnings=tuple(_warnings(records, own)),
    )


def _own(m: Measurement, held: float, model: str, engine: str, progress: Callable[[], None] | None) -> CurrentFit:
    """The record's own fit; of a nonlinear model, which one voltage does not determine, that of its linear part."""
    ions = model.split("+")[0]
    try:
        return fit_current(m, held, ions, engine, progress)
    except (InputError, SolveError) as error:
        raise type(error)(f"{m.source}: {error}") from None


def _fit(
    measurements: Sequence[Measurement],
    own: Sequence[CurrentFit],
    kind: ElectricalModel,
    held: float,
    engine: str,
    progress: Callable[[], None] | None,
) -> tuple[Fit, Port]:
    """The joint fit of some records, from the middle of their own fits."""
    largest = max(m.drive.largest() for m in measurements)
    names = electrical_model(kind.name.split("+")[0]).names
    middle = dict(zip(names, np.exp(np.mean([np.log(single.fit.values) for single in own], axis=0)), strict=True))
    if "cpe_exponent" in middle:
        middle["cpe_exponent"] = float(np.mean([single.fit.values[-1] for single in own]))
    middle |= {"emission_voltage": largest, "capacitance_slope": 0.2 / largest}
    start = np.array([middle[name] for name in kind.names])
    ladders = ladders_for(kind, start, max((single.time[single.time >= 0] for single in own), key=len))
    sigmas = [max(single.fit.rmse, 1e-12 * float(np.abs(single.data).max())) for single in own]
    data = np.concatenate([single.data / sigma for single, sigma in zip(own, sigmas, strict=True)])
    offsets = [k for k, single in enumerate(own) if single.offset is not None]
    ends = np.cumsum([0, *(len(single.data) for single in own)])
    nuisance = np.zeros((len(data), len(offsets)))
    for column, k in enumerate(offsets):
        nuisance[ends[k] : ends[k + 1], column] = 1 / sigmas[k]

    def port(values: Array) -> Port:
        return kind.port(values.tolist(), held, ladders)

    def waves(values: Array) -> Array:
        ports = [port(v) for v in values]
        parts = [
            currents(ports, m.drive, single.time, engine) / sigma
            for m, single, sigma in zip(measurements, own, sigmas, strict=True)
        ]
        return np.concatenate(parts, axis=1)

    below = np.array([p.below for p in kind.parameters])
    fit = fit_circuit(waves, data, kind.names, start, nuisance if offsets else None, progress, below=below)
    fit = in_order(fit, kind.name)
    return fit, port(fit.values)


def _fitted(m: Measurement, single: CurrentFit, port: Port, engine: str) -> Array:
    """What ``port`` makes of a record's drive, with the offset that suits the record."""
    wave = currents([port], m.drive, single.time, engine)[0]
    return np.asarray(wave + float(np.mean(single.data - wave)) if single.offset is not None else wave)


def _rms(residuals: Array) -> float:
    return float(np.sqrt(np.mean(residuals**2)))


def _warnings(records: list[RecordFit], own: Sequence[CurrentFit]) -> list[str]:
    found = []
    unlike = [r.source for r in records if r.joint > _WORSE * r.own]
    if unlike:
        found.append(
            f"one port does not hold for all: {', '.join(unlike)} by itself is fitted {_WORSE:g} times better or more"
        )
    found += dict.fromkeys(w for single in own for w in single.warnings if "one pole" in w)
    return found
