"""The electrical port as a model with fit parameters, and the interface of all kinds of data for it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array
from ..findings import Finding
from ..fit.observation import Observation, Predict
from ..fit.parameter import Parameter
from ..fit.problem import Problem, Progress
from ..fit.result import FitResult
from ..measurements.record import Channel
from ..strip.models import ElectricalModel, Ladders
from ..strip.port import Port

ELECTRODE_RESISTANCE = Parameter("electrode_resistance", "Re", "ohm", "both electrodes, EC (15), (16)")
#: The electron path, which data may not show.
DC = "dc_resistance"
#: Stands for an open circuit in a fit; finite, so that arithmetic stays finite.
INFINITE = 1e200
#: Ladders for closed forms, which do not depend on the number of sections.
ANY_LADDER = Ladders(sections=1)
#: Range of the position of an onset in its bracket, 0 in the middle.
BRACKET = (-0.5, 0.5)
#: Quantities that are measured over time.
BY_TIME = ("current", "voltage")
#: Least standard deviation of an observation, as a fraction of its size: simulated data may have no noise.
_LEAST_SIGMA = 1e-9


@dataclass(frozen=True)
class PortModel:
    """An electrical model and its Re [ohm]: ``held``, or a further parameter if that is None.

    ``typical`` are values (n,) of the model's parameters for which ladders are designed. Its electron path may be
    ``opened``: then it is not fitted.
    """

    kind: ElectricalModel
    held: float | None
    typical: tuple[float, ...] = ()
    opened: bool = False

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (*self.kind.parameters, *(() if self.held is not None else (ELECTRODE_RESISTANCE,)))

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(p.name for p in self.parameters)

    @property
    def fixed(self) -> dict[str, float]:
        """Values of the parameters that are not fitted."""
        return {DC: INFINITE} if self.opened else {}

    def fitted(self, values: Array) -> Array:
        """Return those of ``values`` (n,), in the order of ``names``, that are fitted."""
        return values[[name not in self.fixed for name in self.names]]

    def every(self, fitted: Array) -> Array:
        """Return values in the order of ``names``, from those that are ``fitted``."""
        known = self.fixed | dict(zip((n for n in self.names if n not in self.fixed), fitted.tolist(), strict=True))
        return np.array([known[name] for name in self.names])

    def port(self, values: Array, ladders: Ladders | None = None) -> Port:
        """Return the port with parameters ``values`` (n,) in the order of ``names``."""
        electrode = float(values[-1]) if self.held is None else self.held
        return self.kind.port(values[: len(self.kind.names)].tolist(), electrode, ladders)


@dataclass(frozen=True, eq=False)
class IndividualFit:
    """The individual fit of one file's port ``data`` by ``model``, the requested one or a simpler one.

    ``fixed`` gives the reasons why parameters were not fitted; ``unfelt`` names the fixed parameters without effect on
    the data; ``findings`` are other remarks.
    """

    data: PortData
    model: PortModel
    fit: FitResult
    fixed: Mapping[str, str] = field(default_factory=dict)
    unfelt: tuple[str, ...] = ()
    findings: tuple[Finding, ...] = ()

    @property
    def rms(self) -> float:
        """Root mean square of the residuals, in the unit of the data."""
        return self.fit.rms_of(0)

    @property
    def independent(self) -> float:
        """Effective number of independent samples of its residuals."""
        return self.fit.independent_samples(0)

    @property
    def sure(self) -> bool:
        """True if every parameter is determined at least in its order of magnitude."""
        return bool((self.fit.errors < self.fit.values).all())

    @property
    def values(self) -> dict[str, float]:
        """The fitted values by name."""
        return dict(zip(self.fit.labels, self.fit.values.tolist(), strict=True))


class Measured(Protocol):
    """One measured quantity of one file.

    ``data`` (samples,) are real numbers in ``unit``; ``size`` [unit] is what misfits are compared with; ``voltage`` [V]
    the largest applied, or the bias; ``engine`` names the method of prediction. ``channel`` is the record's, None for
    data that are not over time; ``share`` (-0.5 to 0.5) is the position of the onset in its bracket, 0 in the middle.
    ``bracketed`` is True if the time of the voltage's jump is known only within that bracket.
    """

    @property
    def source(self) -> str: ...
    @property
    def quantity(self) -> str: ...
    @property
    def unit(self) -> str: ...
    @property
    def engine(self) -> str: ...
    @property
    def voltage(self) -> float: ...
    @property
    def abscissa(self) -> Array: ...
    @property
    def data(self) -> Array: ...
    @property
    def size(self) -> float: ...
    @property
    def channel(self) -> Channel | None: ...
    @property
    def share(self) -> float: ...
    @property
    def bracketed(self) -> bool: ...

    def at_share(self, share: float) -> Measured:
        """Return the data with the onset elsewhere in its bracket."""

    def shown(self, numbers: Array) -> NDArray[Any]:
        """Return ``numbers`` in the measured unit [A], [ohm] or [m], one per point of ``abscissa``."""


@runtime_checkable
class PortData(Measured, Protocol):
    """One file's currents or impedances.

    ``level`` [V] is the constant voltage, None for a waveform; ``band`` [Hz] is the range of frequencies of the data;
    ``notes`` are the reader's findings.
    """

    @property
    def level(self) -> float | None: ...
    @property
    def band(self) -> tuple[float, float]: ...
    @property
    def notes(self) -> tuple[Finding, ...]: ...

    def closed(self, model: PortModel) -> bool:
        """Return True if ``model`` is predicted without an engine."""

    def observation(self, model: PortModel, sigma: float | Array = 1.0, *, of_record: bool = False) -> Observation:
        """Return the observation with the prediction of ``model``, by a closed form.

        Without a closed form, or for the prediction ``of_record``, the chosen engine is used.
        """

    def at_share(self, share: float) -> PortData:
        """Return the data with the onset elsewhere in its bracket."""

    @property
    def whole(self) -> PortData:
        """The data with all rows, for data that are reduced for trial fits."""

    def trial(self) -> PortData:
        """Return the data with a reduced number of rows, for trial fits of many models."""

    def individual(self, kind: ElectricalModel, held: float, progress: Progress) -> IndividualFit:
        """Return the fit of these data alone.

        Raises InputError or SolveError if the data do not determine the model.
        """

    def holds(self, kind: ElectricalModel) -> bool:
        """Return True if these data alone could determine the model's parameters."""

    def may_be_open(self, kind: ElectricalModel) -> bool:
        """Return True if an electron path that the data do not show may be an open circuit in the fit of a model."""

    def open_path(self) -> float:
        """Return the Rdc [ohm] that represents an open electron path in the fitted strip."""

    def require_electrode_resistance(self, held: float) -> None:
        """Raise InputError for an Re [ohm] that these data exclude."""


def observed(
    data: Measured, names: tuple[str, ...], predict: Predict, nuisance: Array, sigma: float | Array, channels: int = 1
) -> Observation:
    """Return the observation of ``data`` with the prediction ``predict`` from the parameters ``names``."""
    return Observation(
        source=data.source,
        quantity=data.quantity,
        unit=data.unit,
        x=data.abscissa,
        data=data.data,
        names=names,
        predict=predict,
        nuisance=nuisance,
        sigma=sigma,
        size=data.size,
        channels=channels,
    )


def port_problem(
    data: tuple[PortData, ...],
    model: PortModel,
    sigmas: tuple[float, ...],
    per_record: frozenset[str] = frozenset(),
    *,
    of_record: bool = False,
) -> Problem:
    """Return the problem of all ``data``, residuals divided by their sigmas; see `PortData.observation`."""
    pairs = zip(data, sigmas, strict=True)
    observations = tuple(d.observation(model, sigma, of_record=of_record) for d, sigma in pairs)
    return Problem(observations, model.parameters, per_record, model.fixed)


def sigma_of(fit: FitResult, size: float, rms: float | None = None) -> float:
    """Return the standard deviation by which an observation's residuals are divided, corrected for autocorrelation.

    ``fit`` is the observation's individual fit, ``rms`` a better value of the rms of its residuals, if there is one.
    """
    samples = len(fit.residuals)
    spent = np.sqrt(samples / max(samples - fit.count, 1))
    correlated = np.sqrt(samples / fit.independent_samples(0))
    return max(float((fit.rms_of(0) if rms is None else rms) * spent * correlated), _LEAST_SIGMA * size)
