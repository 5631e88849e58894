"""Several files of one strip fitted together: one port for all currents and spectra, one coupling d(s).

Steps of several voltages and both polarities are what a nonlinear model needs, and what shows whether a linear one
holds; a spectrum shows what is too fast for a step, a step what is too slow for a spectrum. Every data set counts in
units of what its own fit leaves, so that none drowns another. Each is also predicted from the others, which were fitted
without it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError, SolveError
from ..fit.estimate import Parameter
from ..fit.identifiability import DETERMINED
from ..fit.least_squares import Fit
from ..measurements.record import Record
from ..measurements.spectrum import Spectrum
from ..strip.actuator import PAPER, Actuator
from ..strip.elements import lumped_elements
from ..strip.port import Port
from ..units import format_quantity
from .datasets import CurrentData, Dataset, Progress, dataset_of, labelled
from .identification import COUPLING_UNITS
from .joint_current import JointCurrent, fit_port
from .joint_displacement import JointDisplacement, fit_displacements
from .joint_parameters import derived_quantities, parameters_together, uncertainty_together
from .joint_records import RecordFit, displacement_records, leave_one_port_out, misfits, port_records
from .joint_selection import JointCandidate, choose

Array = NDArray[np.float64]


@dataclass(frozen=True)
class JointFit:
    """Result of `fit_jointly`. ``fit``'s residuals are in units of each record's own; ``actuator`` has port and d(s).

    ``parameters`` are the strip's: of those that each record has for itself the geometric mean, the single ones being
    in ``own`` by record. ``records`` are the currents and impedances in the order given, then the displacements.
    """

    model: str
    fit: Fit
    port: Port
    parameters: dict[str, Parameter]
    own: dict[str, dict[str, Parameter]]
    derived: dict[str, Parameter]
    records: tuple[RecordFit, ...]
    displacement: JointDisplacement | None
    actuator: Actuator
    bic: float
    engine: str
    warnings: tuple[str, ...]
    candidates: tuple[JointCandidate, ...] = field(default=())

    def to_json(self) -> dict[str, Any]:
        """As fit.json of a single record, with a list of records."""
        statistics: dict[str, Any] = {"rmse": self.fit.rmse, "bic": self.bic, "n": len(self.fit.residuals)}
        if self.displacement is not None and self.displacement.together is not None:
            moved = self.displacement.together.fit
            statistics["displacement"] = {"rmse": moved.rmse, "n": len(moved.residuals)}
        return {
            "model": self.model,
            "engine": self.engine,
            "parameters": {name: p.to_json() for name, p in self.parameters.items()},
            "own": {source: {n: p.to_json() for n, p in found.items()} for source, found in self.own.items()},
            "derived": {name: p.to_json() for name, p in self.derived.items()},
            "statistics": statistics,
            "records": [r.to_json() for r in self.records],
            "candidates": [c.to_json() for c in self.candidates],
            "warnings": list(self.warnings),
        }


def fit_jointly(
    measurements: Sequence[Record | Spectrum],
    *,
    model: str = "auto",
    base: Actuator | None = None,
    electrode_resistance: float | Literal["fit"] | None = None,
    own: Sequence[str] = (),
    bias: Sequence[float] | None = None,
    engine: str = "ngspice",
    progress: Progress = None,
) -> JointFit:
    """Fit ``model`` (of `strip.models`, or auto) to two records or spectra or more, then d(s) to displacements.

    ``electrode_resistance`` [ohm] is held (default: the base's); "fit" with nonlinear models. ``own`` names parameters
    that each record has for itself. ``bias`` [V] is that of each file, of which records take no notice; default 0.
    Raises InputError for fewer files, or one that cannot be fitted by itself, SolveError as a single fit does.
    """
    if len(measurements) < 2:
        raise InputError("a joint fit needs two records or more")
    sources = labelled([m.source for m in measurements])
    biases = bias if bias is not None else [0.0] * len(measurements)
    datasets = [dataset_of(m, engine, b, s) for m, b, s in zip(measurements, biases, sources, strict=True)]
    _require_different(datasets)
    strip = base or PAPER
    standing = lumped_elements(strip).electrode_resistance if electrode_resistance is None else electrode_resistance
    held = None if isinstance(standing, str) else standing
    own_port = frozenset(own) - COUPLING_UNITS.keys()
    warnings = [f"{d.source}: {note}" for d in datasets for note in d.notes]
    if model == "auto":
        if held is None:
            raise InputError("Re is fitted with a model that is named, such as --model rc+sinh, not with auto")
        found, candidates = choose(datasets, held, own_port, progress)
    elif held is None:
        found, candidates = _with_free_electrodes(datasets, model, own_port, progress, warnings), ()
    else:
        found, candidates = fit_port(datasets, model, held, own_port, progress), ()
    actuator = Actuator.from_port(
        strip.geometry,
        found.port,
        base=strip.material,
        coupling=base.coupling if base is not None else None,
        mounting=strip.mounting,
        name="joint fit",
    )
    without = leave_one_port_out(found, progress)
    records = port_records(found, without)
    warnings += misfits(found, records, without)
    moving = [d for d in datasets if isinstance(d, CurrentData)]
    moved, told = fit_displacements(moving, actuator, engine, frozenset(own) & COUPLING_UNITS.keys(), progress)
    warnings += told
    fits = [found.together]
    if moved is not None:
        actuator = replace(actuator, coupling=moved.coupling)
        records += displacement_records(moved, progress)
        fits += [moved.together] if moved.together is not None else []
        if base is None:
            warnings.append(
                "no --actuator given: geometry and Young's modulus are the paper's; resistances and capacitances do "
                "not depend on them, the coupling gain is in proportion to b^2/L_F^2"
            )
    elif base is not None and base.coupling is not None:
        warnings.append("the coupling was not fitted: it is that of the given actuator")
    uncertainty = uncertainty_together(found.model.kind.name, fits, moved)
    parameters, each = parameters_together(found, fits, moved, uncertainty)
    return JointFit(
        model=found.model.kind.name,
        fit=found.together.fit,
        port=found.port,
        parameters=parameters,
        own=each,
        derived=derived_quantities(found, uncertainty),
        records=tuple(records),
        displacement=moved,
        actuator=replace(actuator, uncertainty=uncertainty),
        bic=found.bic(found.independent()),
        engine=engine,
        warnings=tuple(dict.fromkeys(warnings)),
        candidates=candidates,
    )


def _with_free_electrodes(
    datasets: Sequence[Dataset], model: str, own: frozenset[str], progress: Progress, warnings: list[str]
) -> JointCurrent:
    """The fit with Re free, or held at zero where the data do not determine it, which ``warnings`` tells."""
    try:
        found = fit_port(datasets, model, None, own, progress)
    except SolveError as error:
        why = str(error)
    else:
        fit, at = found.together.fit, found.together.places[:, -1]
        value, stderr = float(fit.values[at].min()), float(fit.errors[at].max())
        if stderr <= DETERMINED * value:
            return found
        why = f"it came out as {format_quantity(value, 'ohm', 2)} +- {format_quantity(stderr, 'ohm', 2)}"
    warnings.append(f"the electrode resistance is not determined by these data ({why}): it is held at zero")
    return fit_port(datasets, model, 0.0, own, progress)


def _require_different(datasets: Sequence[Dataset]) -> None:
    """Raise InputError where two files hold the same readings: counted twice they would look twice as sure."""
    for k, d in enumerate(datasets):
        for earlier in datasets[:k]:
            if np.array_equal(d.data, earlier.data) and np.array_equal(d.abscissa, earlier.abscissa):
                raise InputError(f"'{d.source}' repeats the readings of '{earlier.source}': give each record once")
