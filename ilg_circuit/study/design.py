"""All that a search for a design found out, as JSON-ready values and as files."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from .. import __version__
from ..files import write_text
from ..strip.file import save_actuator
from ..strip.validity import deflection_warnings, run_warnings
from ..units import format_quantity
from .constraints import ActiveConstraint, WithoutRequirement
from .parameters import rewritten
from .pareto import Front
from .problem import Design
from .search import INITIAL_POINTS
from .sensitivity import Sensitivity
from .sobol import SobolIndices

#: A whole number, which needs no .0.
_WHOLE = re.compile(r"(\d)\.0(?=\D|$)")
_DRIVE_NUMBERS = ("voltage", "period", "duty", "frequency", "rate")


@dataclass(frozen=True, eq=False)
class DesignReport:
    """A design and what holds it back, its sensitivity, a front, indices; None for what was not asked for."""

    design: Design | None = None
    limits: Sequence[ActiveConstraint] = ()
    omissions: Sequence[WithoutRequirement] = ()
    sensitivity: Sensitivity | None = None
    confidence: float | None = None
    front: Front | None = None
    sobol: SobolIndices | None = None

    @property
    def warnings(self) -> list[str]:
        """Assumptions of the model that fail at the design, and what a reader of its figures should know."""
        front = deflection_warnings(self.front.bent) if self.front is not None else []
        if self.design is None:
            return front
        scenario, design = self.design.scenario, self.design
        moved = design.simulated.get("displacement_peak", math.nan)
        lines = run_warnings(
            scenario.actuator,
            scenario.drive,
            scenario.duration,
            scenario.drive.largest(),
            abs(moved) if math.isfinite(moved) else None,
        )
        if design.failures:
            total = INITIAL_POINTS[design.problem.space.engine]
            lines.append(f"{design.failures} of the first {total} designs within the ranges could not be judged")
        return lines + front

    def to_json(self) -> dict[str, Any]:
        """JSON-ready values, SI units; what was not asked for is null."""
        return {
            "design": _design(self.design, self) if self.design else None,
            "front": _front(self.front) if self.front else None,
            "sobol": _sobol(self.sobol) if self.sobol else None,
            "warnings": self.warnings,
        }

    def write_json(self, path: Path) -> None:
        """Write `to_json`, whole or not at all."""
        write_text(path, json.dumps(self.to_json(), indent=2, allow_nan=False) + "\n")


def aim(design: Design) -> str:
    """What the design is best at, in words."""
    objective = design.problem.objective
    return objective.text if objective else "largest margin to all requirements"


def design_drive(design: Design) -> str:
    """The design's drive as ``--drive`` takes it, or in words where a voltage scales a square wave or a file."""
    space = design.problem.space
    drive = space.template.drive
    values = {**space.fixed, **design.values}
    changed = {name: float(values[name]) for name in _DRIVE_NUMBERS if name in values}
    if not changed:
        return space.template.drive_text
    if not isinstance(drive, str) or ("voltage" in changed and drive.partition(":")[0] not in ("step", "sine")):
        return design.scenario.drive.text
    return _WHOLE.sub(r"\1", rewritten(drive, changed).replace(" ", ""))


def write_design(design: Design, path: Path) -> None:
    """Write the design's strip as TOML; its comment says what it was designed for, and its drive."""
    actuator, space = design.scenario.actuator, design.problem.space
    lines = [
        f"designed by ilg_circuit {__version__} from '{actuator.name}': {aim(design)}",
        f"drive {design_drive(design)}, {format_quantity(space.template.duration, 's')}, tip {design.scenario.tip}",
    ]
    for r in design.problem.requirements:
        value = format_quantity(design.simulated[r.quantity.name], r.quantity.unit, 6)
        lines.append(f"{r.text}: {value} by ngspice")
    save_actuator(replace(actuator, name=f"{actuator.name}, designed"), path, "\n".join(lines))


def write_front(front: Front, path: Path) -> None:
    """Write a front as CSV: parameters and quantities (ngspice's) with their units, one point a row."""
    columns = {**front.columns, **front.simulated}
    titles = [f"{name}_{unit}" if (unit := front.units[name]) else name for name in columns]
    rows = (",".join(map(repr, row)) for row in np.column_stack(list(columns.values())).tolist())
    write_text(path, "\n".join([",".join(titles), *rows]) + "\n")


def _number(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def _design(design: Design, findings: DesignReport) -> dict[str, Any]:
    problem, search = design.problem, design.search
    objective, found = problem.objective, findings.sensitivity
    return {
        "feasible": design.feasible,
        "aim": aim(design),
        "drive": design_drive(design),
        "parameters": {
            s.parameter.name: {
                "value": design.values[s.parameter.name],
                "unit": s.parameter.unit,
                "low": s.low,
                "high": s.high,
            }
            for s in problem.space.ranges
        },
        "objective": {
            "quantity": objective.quantity.name,
            "unit": objective.quantity.unit,
            "sense": "minimise" if objective.sense > 0 else "maximise",
            "value": _number(design.exact[objective.quantity.name]),
            "ngspice": _number(design.simulated[objective.quantity.name]),
        }
        if objective
        else None,
        "requirements": [
            {
                "text": r.text,
                "quantity": r.quantity.name,
                "relation": r.relation,
                "limit": r.limit,
                "unit": r.quantity.unit,
                "value": _number(design.exact[r.quantity.name]),
                "ngspice": _number(design.simulated[r.quantity.name]),
                "margin": _number(design.margin(r)),
                "met": design.met(r),
                "range": list(map(_number, design.reach[r.quantity.name])),
                "probability": found.met[r.text] if found else None,
            }
            for r in problem.requirements
        ],
        "worst_margin": _number(design.worst_margin),
        "limits": [
            {"what": x.text, "parameter": x.parameter, "end": x.end, "binds": x.binds, "gain_per_percent": x.gain}
            for x in findings.limits
        ],
        "omissions": [{"without": x.requirement.text, "worst_margin": x.margin} for x in findings.omissions],
        "search": {
            "engine": problem.space.engine,
            "scattered": INITIAL_POINTS[problem.space.engine],
            "starts": len(search.ends),
            "agreeing": search.agreeing,
            "spread": dict(zip(problem.space.names, search.spread.tolist(), strict=True)),
        },
        "ngspice": {"largest_difference": design.difference, "estimated_error": design.error},
        "uncertainty": {
            "stderr": found.stderr,
            "shares": found.shares,
            "all_met": found.all_met,
            "drawn": found.drawn,
            "failed": found.failed,
            "confidence": findings.confidence,
        }
        if found
        else None,
    }


def _front(front: Front) -> dict[str, Any]:
    return {
        "objectives": {o.quantity.name: "minimise" if o.sense > 0 else "maximise" for o in front.objectives},
        "units": front.units,
        "parameters": {name: column.tolist() for name, column in front.columns.items()},
        "values": {name: column.tolist() for name, column in front.values.items()},
        "ngspice": {name: column.tolist() for name, column in front.simulated.items()},
        "improvable": front.improvable,
        "largest_difference": front.difference,
    }


def _sobol(found: SobolIndices) -> dict[str, Any]:
    tables = {
        "first": found.first,
        "first_ci95": found.first_error,
        "total": found.total,
        "total_ci95": found.total_error,
    }
    return {
        name: {
            parameter: {key: _number(table[k, j]) for key, table in tables.items()}
            for j, parameter in enumerate(found.parameters)
        }
        for k, name in enumerate(found.quantities)
    }
