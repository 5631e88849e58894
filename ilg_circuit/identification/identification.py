"""The result of an identification: a strip fitted to its measurements."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

from ..findings import Finding, Warned
from ..fit.criteria import ResidualWindow
from ..fit.estimate import Estimate, Estimated
from ..fit.result import FitResult
from ..fit.selection import Candidate
from ..result import Column, Curve, Result
from ..strip.actuator import Actuator
from .coupling_fit import CouplingFit
from .displacement_metrics import DisplacementMetrics
from .kramers_kronig import KramersKronig
from .observation_fit import ObservationFit
from .port_fit import PortFit
from .port_model import Measured

#: Version of the schema of fit.json.
SCHEMA_VERSION = 2


@dataclass(frozen=True, repr=False, eq=False)
class Identification(Estimated, Warned, Result):
    """The fit of a strip to one set of data or to several, as `ilg_circuit.identify` returns it.

    ``fit["capacitance"]`` is a parameter's `Estimate`, with ``value``, ``stderr`` and ``interval``.

    Attributes
    ----------
    parameters : mapping of str to Estimate
        Parameters of the strip. One that each set of data has for itself is given as the geometric mean.
    own : mapping of str to mapping of str to Estimate
        Parameters that each set of data has for itself: name -> set -> estimate.
    derived : mapping of str to Estimate
        Other fitted quantities, such as the onset and the current's offset, and values computed from parameters.
    actuator : Actuator
        The fitted strip, with the coupling if there is one.
    success : bool
        False where the misfit of a file is so large that the parameters mean nothing.
    warnings : tuple of str
        Findings as sentences; ``findings`` have codes and numbers.
    statistics : mapping of str to Any
        Root mean square errors, AIC, BIC and other statistics.
    correlations : mapping of str to float
        Correlation coefficients of pairs of parameters.
    candidates : tuple of Candidate
        Models that "auto" compared.
    observations : tuple of ObservationFit
        Measured and fitted values: the currents and impedances in the order given, then the displacements.
    fit : FitResult
        The fit of all observations in one parameter space.
    port, coupling : PortFit, CouplingFit or None
        Views of the electrical and the electromechanical part, with the individual fits of each set of data.
        There is no port of displacements alone, whose drive was stated: the circuit was not fitted.
    films : tuple of str
        Files of displacements alone.
    engine : str
        What checked the fitted circuit.
    seed : int or None
        Seed of random numbers, if any were drawn.
    """

    presenter: ClassVar[str] = "identification"

    actuator: Actuator
    fit: FitResult
    port: PortFit | None
    coupling: CouplingFit | None
    parameters: Mapping[str, Estimate]
    own: Mapping[str, Mapping[str, Estimate]]
    derived: Mapping[str, Estimate]
    statistics: Mapping[str, Any]
    correlations: Mapping[str, float]
    observations: tuple[ObservationFit, ...]
    candidates: tuple[Candidate, ...]
    findings: tuple[Finding, ...]
    engine: str
    seed: int | None = None
    films: tuple[str, ...] = ()

    @property
    def model(self) -> str:
        """Name of the electrical model; of a coupling alone ``d(s)``."""
        return self.port.kind.name if self.port is not None else "d(s)"

    @property
    def data(self) -> tuple[Measured, ...]:
        """The fitted data, one quantity per file: currents and impedances, then displacements alone."""
        moved = self.coupling.data if self.coupling is not None else ()
        return (*(self.port.data if self.port is not None else ()), *(d for d in moved if d.source in self.films))

    @property
    def sources(self) -> tuple[str, ...]:
        """The files in the order given, files of displacements alone last."""
        return (*(d.source for d in (self.port.data if self.port is not None else ())), *self.films)

    @property
    def single(self) -> bool:
        """True if one file was given."""
        return len(self.sources) == 1

    @property
    def success(self) -> bool:
        """False where the misfit of a file is so large that the parameters mean nothing."""
        return not any(o.misfit is not None and o.misfit.fail for o in self.observations)

    @property
    def metrics(self) -> DisplacementMetrics | None:
        """Peak, overshoot, settling, back-relaxation of a single file; None where they are not defined."""
        return next((o.metrics for o in self.observations if o.metrics is not None), None) if self.single else None

    @property
    def check(self) -> KramersKronig | None:
        """The Kramers-Kronig check of a single spectrum."""
        return self.observations[0].check if self.single else None

    @property
    def residual_windows(self) -> dict[str, tuple[ResidualWindow, ...]]:
        """Residuals by windows of time for each quantity of a single record."""
        if not self.single or self.observations[0].quantity == "impedance":
            return {}
        last = float(self.observations[0].abscissa[-1])
        return {o.quantity: o.windows(last) for o in self.observations}

    def estimate_tables(self) -> dict[str, Mapping[str, Estimate]]:
        """Return parameters, with names such as capacitance[1V.csv] for single records, and derived quantities."""
        own = {f"{name}[{file}]": e for file, found in self.own.items() for name, e in found.items()}
        return {"parameter": self.parameters, "own": own, "derived": self.derived}

    def curves(self) -> Iterator[Curve]:
        """Yield every observation with the joint fit."""
        for o in self.observations:
            name, unit = ("frequency", "Hz") if o.quantity == "impedance" else ("time", "s")
            yield Curve(o.quantity, o.unit or "ohm", o.source, Column(name, o.abscissa, unit), o.data, o.fitted)

    def write_strip(self, path: str | Path) -> None:
        """Write the fitted strip as a TOML file, whose comment states its origin.

        Parameters
        ----------
        path : str or Path
            The file to write; it is replaced whole or not at all.

        Raises
        ------
        InputError
            The file cannot be written.
        """
        self._shown("write_actuator", path)

    def to_dict(self) -> dict[str, Any]:
        """Return fit.json: one schema for one file or several, of any kind."""
        metrics = self.metrics
        laws = [row.to_dict() for row in self.coupling.laws] if self.coupling is not None else []
        return {
            "schema_version": SCHEMA_VERSION,
            "success": self.success,
            "model": self.model,
            "source": ", ".join(self.sources),
            "engine": self.engine,
            "parameters": _plain(self.parameters),
            "own": {source: _plain(found) for source, found in self.own.items()},
            "derived": _plain(self.derived),
            "statistics": dict(self.statistics),
            "residual_windows": {name: [w.to_dict() for w in rows] for name, rows in self.residual_windows.items()},
            "displacement": {"figures": metrics.to_dict() if metrics else None, "laws": laws},
            "kramers_kronig": self.check.to_dict() if self.check else None,
            "correlations": dict(self.correlations),
            "residuals": [vars(left) for left in self.actuator.uncertainty.residuals]
            if self.actuator.uncertainty
            else [],
            "records": [o.to_dict() for o in self.observations],
            "candidates": [c.to_dict() for c in self.candidates],
            "warnings": list(self.warnings),
            "findings": [f.to_dict() for f in self.findings],
            "provenance": self.provenance.to_dict(),
        }


def _plain(estimates: Mapping[str, Estimate]) -> dict[str, Any]:
    return {name: e.to_dict() for name, e in estimates.items()}
