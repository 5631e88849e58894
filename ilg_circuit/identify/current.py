"""The measured current as an observation of the port, and its fit by itself."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Array, Mask
from ..circuit.strip import port_netlist
from ..drive import PiecewiseLinear
from ..errors import InputError
from ..findings import Finding
from ..fit.fitting import fit, with_starts
from ..fit.observation import Observation, Predict
from ..fit.problem import Progress
from ..measurements.record import Record
from ..simulation.response import transient_band
from ..solve.transient import DEFAULT_ACCURACY, transient
from ..strip.models import ElectricalModel
from ..strip.port import Port
from ..units import format_quantity
from .current_search import fit_from_several, search_starts
from .modal import Ports, modal_currents
from .port_model import IndividualFit, PortModel, observed, port_problem, quickened
from .start import model_start

#: Error of a nonlinear model's transient in a fit, relative to the largest current.
_NONLINEAR_ACCURACY = 1e-6
#: So many samples before the onset tell the instrument's offset.
_REST = 5
#: ngspice needs a fine grid after every jump; the exact engine an exponential for every width of an interval.
_MANY_JUMPS, _FEW_WIDTHS = 12, 40
#: Models of two relaxations or fewer are small circuits.
_SMALL = 2


@dataclass(frozen=True)
class CurrentData:
    """The current of a record over time since the onset [s]; samples at rest only where they tell the offset."""

    record: Record
    engine: str
    source: str

    quantity = "current"
    unit = "A"

    @property
    def notes(self) -> tuple[Finding, ...]:
        return self.record.notes

    @property
    def voltage(self) -> float:
        """Largest voltage applied [V], with its sign."""
        values = self.record.drive.values
        return float(values[np.argmax(np.abs(values))])

    @property
    def level(self) -> float | None:
        return self.record.step

    @property
    def has_offset(self) -> bool:
        """True if there are enough samples before the onset to fit the current offset."""
        return int(self.record.current.rest.sum()) >= _REST

    @property
    def _kept(self) -> Mask:
        rest = self.record.current.rest
        return np.ones(len(rest), dtype=bool) if self.has_offset else ~rest

    @property
    def abscissa(self) -> Array:
        return self.record.current.time[self._kept]

    @property
    def data(self) -> Array:
        return self.record.current.values[self._kept]

    @property
    def size(self) -> float:
        return float(np.abs(self.data).max())

    @property
    def band(self) -> tuple[float, float]:
        return transient_band(self.abscissa[self.abscissa >= 0])

    def shown(self, numbers: Array) -> Array:
        return numbers

    def ports(self, model: PortModel) -> Ports:
        """Return the function from values (k, n) to the ports that they make, with ladders for this record."""
        ladders = model.kind.ladders(np.array(model.typical), self.band)
        return lambda values: [model.port(v, ladders) for v in values]

    def observation(self, model: PortModel, sigma: float = 1.0) -> Observation:
        t, ports = self.abscissa, self.ports(model)

        def predict(values: Array) -> Array:
            return currents(ports(values), self.record.drive, t, self.engine)

        nuisance = np.ones((len(t), int(self.has_offset)))
        return observed(self, model.names, predict, nuisance, sigma)

    def quick(self, model: PortModel) -> Predict | None:
        return self.modal(model, self.abscissa) if model.kind.linear else None

    def modal(self, model: PortModel, t: Array) -> Predict:
        """Return the prediction of a linear model at ``t`` [s] as a sum of modes, zero before the onset at 0."""
        after, ports = t >= 0, self.ports(model)

        def predict(values: Array) -> Array:
            waveforms = np.zeros((len(values), len(t)))
            waveforms[:, after] = modal_currents(ports(values), self.record.drive, t[after])
            return waveforms

        return predict

    def require_electrode_resistance(self, held: float) -> None:
        if not (math.isfinite(held) and held >= 0):
            raise InputError(f"electrode resistance {held:g} ohm must be zero or more")
        after = self.record.current.time >= 0
        i, u = self.record.current.values[after], self.record.drive.value(self.record.current.time[after])
        k = int(np.argmax(np.abs(i)))
        if held and held * abs(i[k]) >= abs(u[k]):
            peak = format_quantity(abs(i[k]), "A", 4)
            raise InputError(
                f"electrode resistance {held:g} ohm is too large: the peak current of {peak} allows less than "
                f"{abs(u[k] / i[k]):.4g} ohm"
            )

    def holds(self, kind: ElectricalModel) -> bool:
        # one step does not tell a sinh electron path from a resistor
        return not (kind.spectra_only or (kind.constant_voltage_hides and self.level is not None))

    def trial_engine(self, kind: ElectricalModel) -> str:
        """Return the engine that tries a model: the exact one for large circuits where many jumps make ngspice slow.

        Its answer is ngspice's to eight digits; the model that is chosen is fitted by the engine of record.
        """
        if not kind.linear or kind.ions.branch_counts[0] <= _SMALL or len(self.record.drive.times) < _MANY_JUMPS:
            return self.engine
        t = self.record.current.time
        widths = np.diff(np.union1d(t[t >= 0], self.record.drive.times))
        return "exact" if len(np.unique(np.round(widths / widths.max(), 9))) <= _FEW_WIDTHS else self.engine

    def individual(self, kind: ElectricalModel, held: float, progress: Progress) -> IndividualFit:
        self.require_electrode_resistance(held)
        t, data, drive = self.abscissa, self.data, self.record.drive
        offset = float(data[t < 0].mean()) if self.has_offset else 0.0
        start = model_start(kind, t[t >= 0], data[t >= 0] - offset, drive, held)
        model = PortModel(kind, held, tuple(start.tolist()))
        if not kind.linear:
            return IndividualFit(model, fit_from_several(port_problem((self,), model, (1.0,)), start, progress))
        # multi-start by the closed form of few samples, then of all, which leaves little to do for the engine
        problem = quickened(port_problem((self,), model, (1.0,)), (self,), model)
        values, starts, check = search_starts(problem, lambda t: self.modal(model, t), start)
        model = PortModel(kind, held, tuple(values.tolist()))
        tried = replace(self, engine=self.trial_engine(kind))
        whole = port_problem((tried,), model, (1.0,))
        quick = quickened(whole, (self,), model)
        near = fit(quick, values).values
        found = fit(whole, near[kind.order(near)], progress)
        check(found.values)
        return IndividualFit(model, with_starts(found.predicting(quick), starts))


def currents(ports: Sequence[Port], drive: PiecewiseLinear, t: Array, engine: str) -> Array:
    """Return currents [A] (ports, samples) into ``ports`` of one model at ``t`` [s]; zero before the onset at 0."""
    after = t >= 0
    result = np.zeros((len(ports), len(t)))
    linear = ports[0].linear
    accuracy = DEFAULT_ACCURACY if linear else _NONLINEAR_ACCURACY
    acceptable = accuracy if linear else 10 * accuracy
    netlists = [port_netlist(port) for port in ports]
    found = transient(netlists, drive, t[after], engine=engine, accuracy=accuracy, acceptable=acceptable)
    result[:, after] = found.values[:, 0]
    return result
