"""The electrical port as a fit sees it, and what every kind of data about it has in common."""

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
#: A closed form takes a ladder's constants from the port, however many sections it has.
ANY_LADDER = Ladders(sections=1)
#: Shares of an onset's bracket, from its middle to its ends.
BRACKET = (-0.5, 0.5)
#: An observation counts as if it had noise of this part of its size at least: simulated ones may have none.
_LEAST_SIGMA = 1e-9


@dataclass(frozen=True)
class PortModel:
    """An electrical model and its Re [ohm]: ``held``, or one more parameter where that is None.

    ``typical`` are values (n,) of the model's parameters for which ladders are designed.
    """

    kind: ElectricalModel
    held: float | None
    typical: tuple[float, ...] = ()

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (*self.kind.parameters, *(() if self.held is not None else (ELECTRODE_RESISTANCE,)))

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(p.name for p in self.parameters)

    def port(self, values: Array, ladders: Ladders | None = None) -> Port:
        """Return the port that ``values`` (n,), in the order of ``names``, make."""
        electrode = float(values[-1]) if self.held is None else self.held
        return self.kind.port(values[: len(self.kind.names)].tolist(), electrode, ladders)


@dataclass(frozen=True, eq=False)
class IndividualFit:
    """The individual fit of one file's port ``data`` by ``model``, the requested one or a simpler one.

    ``fixed`` gives the reasons why parameters were not fitted, which the data do not determine; ``unfelt`` names
    those among them that have no effect; ``findings`` are other remarks.
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
        """Number of independent samples that its residuals amount to."""
        return self.fit.independent_samples(0)

    @property
    def sure(self) -> bool:
        """True if every parameter is known at least in its order of magnitude."""
        return bool((self.fit.errors < self.fit.values).all())

    @property
    def values(self) -> dict[str, float]:
        """The values that were fitted, by name."""
        return dict(zip(self.fit.labels, self.fit.values.tolist(), strict=True))


class Measured(Protocol):
    """One measured quantity of one file.

    ``data`` (samples,) are real numbers in ``unit``; ``size`` [unit] is what misfits are compared with; ``voltage`` [V]
    the largest applied, or the bias; ``engine`` names what predicts the data. ``channel`` is the record's, whose onset
    is taken by ``share`` (-0.5 to 0.5) of its bracket from the middle; None for data that are not over time.
    ``bracketed`` says whether the readings leave open when the voltage jumped.
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
        """Return ``numbers`` as they were measured [A], [ohm] or [m], one a point of ``abscissa``."""


@runtime_checkable
class PortData(Measured, Protocol):
    """One file's currents or impedances.

    ``level`` [V] is the voltage of all the time, None for a waveform; ``band`` [Hz] is what the data cover; ``notes``
    are the reader's findings.
    """

    @property
    def level(self) -> float | None: ...
    @property
    def band(self) -> tuple[float, float]: ...
    @property
    def notes(self) -> tuple[Finding, ...]: ...

    def observation(self, model: PortModel, sigma: float | Array = 1.0, *, of_record: bool = False) -> Observation:
        """Return the observation that ``model`` predicts: by a closed form, or where there is none, or for the
        prediction ``of_record``, by the engine that was asked for."""

    def at_share(self, share: float) -> PortData:
        """Return the data with the onset elsewhere in its bracket."""

    @property
    def whole(self) -> PortData:
        """The data with all rows, if these are the rows of a trial."""

    def trial(self) -> PortData:
        """Return the data with few enough rows to try many models."""

    def individual(self, kind: ElectricalModel, held: float, progress: Progress) -> IndividualFit:
        """Return the fit of these data alone.

        Raises InputError or SolveError where they do not hold the model.
        """

    def holds(self, kind: ElectricalModel) -> bool:
        """Return True if these data alone could determine the model's parameters."""

    def require_electrode_resistance(self, held: float) -> None:
        """Raise InputError for an Re [ohm] that these data exclude."""


def observed(
    data: Measured, names: tuple[str, ...], predict: Predict, nuisance: Array, sigma: float | Array, channels: int = 1
) -> Observation:
    """Return the observation of ``data`` that ``predict`` makes of the parameters ``names``."""
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
    fixed: Mapping[str, float] | None = None,
    *,
    of_record: bool = False,
) -> Problem:
    """Return the problem of all ``data``, each counting in units of its sigma; see `PortData.observation`."""
    pairs = zip(data, sigmas, strict=True)
    observations = tuple(d.observation(model, sigma, of_record=of_record) for d, sigma in pairs)
    return Problem(observations, model.parameters, per_record, dict(fixed or {}))


def sigma_of(fit: FitResult, size: float, rms: float | None = None) -> float:
    """Return the unit in which an observation's residuals count: their deviation, as far as samples are independent.

    ``fit`` is the observation's individual fit, ``rms`` a better value of its residuals' size if there is one.
    """
    samples = len(fit.residuals)
    spent = np.sqrt(samples / max(samples - fit.count, 1))
    correlated = np.sqrt(samples / fit.independent_samples(0))
    return max(float((fit.rms_of(0) if rms is None else rms) * spent * correlated), _LEAST_SIGMA * size)
