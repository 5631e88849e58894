"""Collects the rows of all observations of an identification: of the port's data, then of the displacements."""

from __future__ import annotations

from dataclasses import replace

from ..fit.problem import Progress
from ..fit.result import FitResult
from ..strip.elements import lumped_elements
from .coupling_fit import CouplingFit
from .displacement_metrics import displacement_metrics
from .estimates import displacement_quantities, file_quantities
from .impedance import ImpedanceData
from .observation_fit import LeftOut, ObservationFit, leave_one_out, leave_one_port_out, observation_fits
from .port_fit import PortFit
from .port_model import Measured


def all_observations(
    port: PortFit | None, coupling: CouplingFit | None, fit: FitResult, progress: Progress
) -> tuple[list[ObservationFit], LeftOut]:
    """Return the rows of all observations, and the ports' fits without each file in turn."""
    rows: list[ObservationFit] = []
    without: LeftOut = []
    own: list[tuple[str, Measured, FitResult]]
    if port is not None:
        without = leave_one_port_out(port, progress)
        pairs = zip(port.data, port.individual, strict=True)
        own = [(i.model.kind.name, d, i.fit) for d, i in pairs]
        rows = observation_fits(port.data, own, port.fit, without, fit, 0)
        for k, d in enumerate(port.data):
            check = d.check if isinstance(d, ImpedanceData) else None
            rows[k] = replace(rows[k], derived=file_quantities(d, fit, k), check=check)
    if coupling is None:
        return rows, without
    first, ratio = len(rows), lumped_elements(coupling.motion.actuator).bending_ratio
    own = [("d(s)", i.data, i.fit) for i in coupling.individual]
    left_out = leave_one_out(coupling.fit, progress)
    moved = observation_fits(coupling.data, own, coupling.fit, left_out, fit, first)
    for k, (i, data) in enumerate(zip(coupling.individual, coupling.data, strict=True)):
        per_volt = data.sign * ratio * coupling.coupling.static
        derived = displacement_quantities(i, fit.nuisance_of(first + k), per_volt)
        moved[k] = replace(moved[k], derived=derived, metrics=displacement_metrics(i))
    return [*rows, *moved], without
