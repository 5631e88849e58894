"""Statistics of an identification, as fit.json gives them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..fit.intervals import Uncertainties
from ..fit.judge import Judgement
from ..fit.result import FitResult
from ..fit.selection import Candidate
from .coupling_fit import CouplingFit
from .impedance import ImpedanceData
from .observation_fit import ObservationFit
from .port_fit import PortFit


def statistics_of(
    port: PortFit | None,
    coupling: CouplingFit | None,
    fit: FitResult,
    rows: Sequence[ObservationFit],
    candidates: Sequence[Candidate],
    intervals: Uncertainties,
) -> dict[str, Any]:
    """Return the statistics of the port, and the coupling's under "displacement".

    For a single file the rmse is in its unit; for several files residuals are divided by their sigmas. Without a port
    all statistics are the coupling's.
    """
    count = len(port.data) if port is not None else 0
    statistics = _port_statistics(port, rows, candidates) if port is not None else _without_port(fit, rows)
    if coupling is not None:
        statistics["displacement"] = _displacement_statistics(coupling, fit, rows, count)
    details = {p.problem.observations[0].quantity: d for p, d in zip(fit.parts, intervals.details, strict=False)}
    if details:
        flat = next(iter(details.values())) if list(details) == ["impedance"] else {}
        statistics["intervals"] = {**details, **flat}
    return statistics


#: Statistics that are not defined for every kind of fit.
_UNKNOWN = (
    "rmse_over_peak",
    "relative_rms",
    "complex_rms",
    "worst_window",
    "independent",
    "weighting",
    "displacement",
)


def _without_port(fit: FitResult, rows: Sequence[ObservationFit]) -> dict[str, Any]:
    """Return the statistics of displacements alone, by the names of a port's."""
    rmse = float(np.sqrt(np.mean(fit.residuals**2)))
    statistics: dict[str, Any] = {"rmse": rmse, "rmse_unit": "", "aic": None, "bic": None, "n": len(fit.residuals)}
    statistics |= dict.fromkeys(_UNKNOWN)
    if len(rows) == 1:
        statistics |= dict(rows[0].statistics) | {"rmse_unit": rows[0].unit}
    return statistics | {
        "evaluations": fit.parts[0].evaluations,
        "starts": fit.starts.starts,
        "starts_agreeing": fit.starts.agreeing,
        "relative_offset": fit.parts[0].offset,
        "identifiability": None,
    }


def _port_statistics(port: PortFit, rows: Sequence[ObservationFit], candidates: Sequence[Candidate]) -> dict[str, Any]:
    chosen = next(c for c in candidates if c.chosen)
    count = len(port.data)
    port_fit, single = port.fit, count == 1
    samples = slice(0, port_fit.problem.slices[count - 1].stop)
    statistics: dict[str, Any] = {"rmse": float(np.sqrt(np.mean(port_fit.residuals[samples] ** 2))), "rmse_unit": ""}
    statistics |= {"aic": None, "bic": chosen.bic, "n": samples.stop}
    statistics |= dict.fromkeys(_UNKNOWN)
    if single:
        first = port.data[0]
        statistics |= dict(rows[0].statistics) | {"rmse_unit": first.unit}
        if isinstance(first, ImpedanceData):
            residuals = first.shown(port_fit.residuals_of(0))
            low, high, worst = first.worst_window(port_fit.residuals_of(0))
            statistics |= {
                "rmse": float(np.sqrt(np.mean(np.abs(residuals) ** 2) / 2)),
                "rmse_unit": "ohm",
                "relative_rms": first.relative_rms(port_fit.residuals_of(0)),
                "complex_rms": first.complex_rms(port_fit.residuals_of(0)),
                "worst_window": {"from_Hz": low, "to_Hz": high, "complex_rms": worst},
                "independent": chosen.independent,
                "weighting": first.weighting,
            }
        else:
            statistics["rmse_over_peak"] = rows[0].rms_joint / first.size
    return statistics | {
        "evaluations": port_fit.parts[0].evaluations,
        "starts": chosen.starts,
        "starts_agreeing": chosen.starts_agreeing,
        "relative_offset": port_fit.parts[0].offset,
        "identifiability": chosen.identifiability.to_dict() if chosen.identifiability else None,
    }


def told(judgement: Judgement | None) -> dict[str, Any]:
    """Return the engine of record's judgement of a fit by a closed form, as plain data."""
    if judgement is None:
        return {"judgement": None}
    return {"judgement": {"largest_move_in_standard_errors": judgement.move, "refitted": judgement.refitted}}


def _displacement_statistics(
    coupling: CouplingFit, fit: FitResult, rows: Sequence[ObservationFit], first: int
) -> dict[str, Any]:
    last = fit.parts[-1]
    moved = [r for r in rows if r.quantity == "displacement"]
    residuals = np.concatenate([fit.residuals[s] for s in fit.problem.slices[first:]])
    statistics: dict[str, Any] = {"rmse": float(np.sqrt(np.mean(residuals**2))), "rmse_unit": "", "n": len(residuals)}
    if len(moved) == 1:
        statistics |= dict(moved[0].statistics) | {"rmse_unit": "m"}
        statistics["window_s"] = coupling.individual[0].data.window
    starts = coupling.fit.starts
    return statistics | {
        "beam": coupling.motion.beam,
        "evaluations": last.evaluations,
        "starts": starts.starts,
        "starts_agreeing": starts.agreeing,
        "relative_offset": last.offset,
    }
