"""The measured current as an observation of the port, and its individual fit."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal, Self

import numpy as np
from numpy.typing import NDArray

from ..arrays import Array
from ..drive import PiecewiseLinear
from ..errors import InputError, argument
from ..findings import Finding
from ..fit.fitting import fit
from ..fit.observation import Observation, Predict
from ..fit.problem import Progress
from ..measurements.prepare import LEAST_REST, tells_offset
from ..measurements.record import Channel, Record
from ..measurements.voltage import MeasuredDrive
from ..simulation.response import transient_band
from ..strip.models import ElectricalModel
from ..strip.port import Port
from ..units import format_quantity
from .jump_start import places_by_relaxation
from .jumps import at_distances, too_many, unknown
from .modal import Ports
from .open_path import OPEN
from .port_model import DC, IndividualFit, PortModel, observed, port_problem
from .port_response import ACCURACY, Response, closed, engine_currents
from .start import FewerRelaxations, model_start, thinned
from .stored import decaying_terms

#: Largest number of rows of a fit, and of the trial fits that compare models.
_MOST_ROWS, _TRIAL_ROWS = 4000, 2000
#: Tolerance of a fit of which only the residuals are used.
_ROUGH = 1e-5
#: Voltages of more than this share of the largest are of its size; those of less than the rest are next to zero.
_ONE_SIZE = 0.95


@dataclass(frozen=True)
class CurrentData:
    """The current of a record over time since the onset [s], with samples at rest if they determine the offset.

    ``share`` (-0.5 to 0.5) is the position of the onset in the record's bracket, 0 in the middle; ``left_out`` are
    rows of the record's current that are not fitted, such as outliers; ``only`` are the rows of a trial fit, None for
    all. Readings later than ``until`` [s] after the onset are not fitted. ``accuracy`` is an engine's in a transient,
    relative to the largest value. ``places`` [s] are those of the drive's later jumps, see `MeasuredDrive`.
    ``rival`` [A] is the rms of residuals of another model, beside which a fit's jumps need no places if it is worse;
    ``opened`` is that a simpler model's fit has no electron path, see `open_path`.
    """

    record: Record
    engine: str
    source: str
    share: float = 0.0
    left_out: tuple[int, ...] = ()
    only: NDArray[np.intp] | None = None
    until: float = math.inf
    accuracy: float = ACCURACY
    places: tuple[float, ...] = ()
    opened: bool = False
    rival: float = math.inf

    quantity = "current"
    unit = "A"

    @property
    def notes(self) -> tuple[Finding, ...]:
        count = too_many(self)
        return (*self.record.notes, *([Finding("jumps-not-placed", values={"count": count})] if count else []))

    @cached_property
    def drive(self) -> PiecewiseLinear:
        """The voltage since the onset."""
        return self.measured.moved(self.share, self.onset_width)

    def leaving_out(self, rows: NDArray[np.intp]) -> CurrentData:
        """Return the data without more ``rows`` of the record's current."""
        return replace(self, left_out=tuple(sorted({*self.left_out, *rows.tolist()})))

    @property
    def since(self) -> Array:
        """Time since the assumed onset [s] (samples,)."""
        return self._kept.since(self.share)

    @property
    def channel(self) -> Channel:
        """The readings that are fitted, the record's current, with their bracket of the onset."""
        return self.record.current

    @property
    def measured(self) -> MeasuredDrive:
        """The measured drive."""
        return replace(self.record.voltage, places=self.places)

    @property
    def onset_width(self) -> float:
        """Width [s] of the interval of the onset."""
        return self.channel.width

    @property
    def bracketed(self) -> bool:
        """True if what all jumps have in common is known only within their brackets."""
        return bool(self.channel.width or (self.measured.stated is None and self.measured.widths.any()))

    def at_share(self, share: float) -> Self:
        return replace(self, share=share)

    def at_places(self, places: Array) -> Self:
        """Return the data with the drive's later jumps elsewhere in their intervals."""
        return replace(self, places=tuple(places.tolist()))

    @property
    def voltage(self) -> float:
        """Largest voltage applied [V], with its sign."""
        values = self.drive.values
        return float(values[np.argmax(np.abs(values))])

    @property
    def delay(self) -> float | Literal["fit"]:
        """Delay [s] of the displacement's clock; "fit" where it is unknown: of a separate clock, or a late current."""
        return "fit" if self.record.own_clock or self.late else 0.0

    @property
    def late(self) -> float:
        """How late the current answers the voltage's jump [s], where that is more than one reading, else 0."""
        return self.record.late

    @property
    def level(self) -> float | None:
        return self.record.step

    @property
    def has_offset(self) -> bool:
        """True if samples before the onset, or the levels of a run, determine the offset."""
        return tells_offset(self.channel, self.measured.drive, self.record.beginning)

    @property
    def drifts(self) -> bool:
        """True if the readings at rest drift beyond doubt: a straight line is then fitted beside the model."""
        return self.has_offset and self.record.beginning != "run" and self.channel.at_rest.drifts

    @cached_property
    def rows(self) -> NDArray[np.intp]:
        """The rows of the record's current that are fitted."""
        rest = self.channel.rest
        kept = np.ones(len(rest), dtype=bool) if self.channel.at_rest.count >= LEAST_REST else ~rest
        kept[list(self.left_out)] = False
        kept &= self.channel.time <= self.until
        return np.flatnonzero(kept) if self.only is None else self.only[kept[self.only]]

    @property
    def whole(self) -> CurrentData:
        """The data with all rows."""
        return replace(self, only=None)

    def trial(self) -> CurrentData:
        """Return the data with a reduced number of rows, for trial fits of many models."""
        return self if len(self.rows) <= _MOST_ROWS else self.some_rows(_TRIAL_ROWS)

    def some_rows(self, most: int) -> CurrentData:
        """Return the data with at most ``most`` rows, dense where the transient is fast."""
        return replace(self, only=self.rows[thinned(self.abscissa, most)])

    @cached_property
    def _kept(self) -> Channel:
        channel = self.channel
        dropped = np.ones(len(channel.time), dtype=bool)
        dropped[self.rows] = False
        return channel.without(dropped)

    @property
    def abscissa(self) -> Array:
        return self._kept.time

    @property
    def data(self) -> Array:
        return self._kept.values

    @property
    def size(self) -> float:
        return float(np.abs(self.data).max())

    @property
    def band(self) -> tuple[float, float]:
        return transient_band(self.abscissa[self.abscissa >= 0])

    def shown(self, numbers: Array) -> Array:
        return numbers

    def ports(self, model: PortModel) -> Ports:
        """Return the function from values (k, n) to ports with ladders for this record."""
        ladders = model.kind.ladders(np.array(model.typical), self.band)
        return lambda values: [model.port(v, ladders) for v in values]

    def observation(self, model: PortModel, sigma: float | Array = 1.0, *, of_record: bool = False) -> Observation:
        cheap = self.closed(model) and not (of_record and self.engine != "exact")
        predict = self.without_engine(model, self.since) if cheap else self._by_engine(model)
        return observed(self, model.names, predict, self.nuisance, sigma)

    @cached_property
    def nuisance(self) -> Array:
        """Linear terms (samples, q): offset, drift, and the initial state of a record that begins within a run."""
        offset = np.broadcast_to(1.0, (len(self.data), int(self.has_offset)))
        if self.drifts:
            return np.column_stack([offset, self.abscissa])
        if self.record.beginning != "run":
            return offset
        return np.column_stack([offset, decaying_terms(self.since, centred=self.has_offset)])

    def _by_engine(self, model: PortModel) -> Predict:
        t, ports = self.since, self.ports(model)
        return lambda values: self._solved(ports(values), t)

    def _solved(self, ports: Sequence[Port], t: Array) -> Array:
        """Return the predictions (ports, samples) at ``t`` [s] by the engine."""
        return engine_currents(ports, self.drive, t, self.engine, self.accuracy)

    def closed(self, model: PortModel) -> bool:
        """Return True if a model is predicted without an engine."""
        return closed(model, by_current=self.response.by_current)

    @property
    def response(self) -> Response:
        """What ports answer to the drive without an engine."""
        return Response(self.drive)

    def without_engine(self, model: PortModel, t: Array) -> Predict:
        """Return the prediction of a model at ``t`` [s] since the onset, see `port_response`."""
        return self.response.prediction(self.ports(model), t)

    def require_electrode_resistance(self, held: float) -> None:
        if not (math.isfinite(held) and held >= 0):
            raise InputError(f"electrode resistance {held:g} ohm must be zero or more")
        after = self.channel.time >= 0
        rest = self.channel.values[~after]
        i = self.channel.values[after] - (float(np.median(rest)) if len(rest) else 0.0)
        u = self.measured.drive.value(self.channel.time[after])
        k = int(np.argmax(np.abs(i)))
        # ions may hold any voltage of the past, so that a strip that is discharged gives a current at no voltage
        past = np.append(u[: k + 1], self.measured.drive.rest)
        reach = float(np.abs(past - u[k]).max())
        if held and held * abs(i[k]) >= reach:
            peak = format_quantity(abs(i[k]), "A", 4)
            raise InputError(
                f"electrode resistance {held:g} ohm is too large: the peak current of {peak} allows less than "
                f"{reach / abs(i[k]):.4g} ohm"
            )

    def holds(self, kind: ElectricalModel) -> bool:
        # one step, or a square wave, cannot distinguish a sinh electron path from a resistor
        return not (kind.spectra_only or (kind.constant_voltage_hides and self._of_one_size))

    def may_be_open(self, kind: ElectricalModel) -> bool:
        return DC in kind.names and not kind.constant_voltage_hides  # a law of the path needs one

    def open_path(self) -> float:
        return OPEN * (abs(self.voltage) or 1.0) / self.size

    @property
    def _of_one_size(self) -> bool:
        """True if the voltage is always of one size, of either sign, or next to zero."""
        sizes = np.abs(np.append(self.drive.value(self.since[self.since >= 0]), self.drive.rest))
        largest = float(sizes.max())
        return bool(((sizes > _ONE_SIZE * largest) | (sizes < (1 - _ONE_SIZE) * largest)).all())

    def individual(self, kind: ElectricalModel, held: float, progress: Progress) -> IndividualFit:
        from .current_fit import fit_alone

        self.require_electrode_resistance(held)
        return fit_alone(self, kind, held, progress)

    def roughly_placed(self) -> Self:
        """Return the data with the drive's jumps where the current places them if one relaxation is taken for it."""
        if not unknown(self):
            return self
        after = self.since >= 0
        t, i, keep = self.since[after], self.data[after] - self._rest_current, thinned(self.since[after])
        widths = np.append(self.onset_width, self.measured.widths[1:])
        stored = self.nuisance[after, int(self.has_offset) :]
        places = places_by_relaxation(t[keep], i[keep], self.drive.from_rest(), widths, stored[keep])
        return at_distances(self, places)

    def rough_residuals(self, kind: ElectricalModel, held: float) -> Array:
        """Return residuals [A] (samples,) of a linear model, fitted from its suggested start alone."""
        few = self.trial()
        model = PortModel(kind, held, tuple(few.start(kind, held).tolist()))
        found = fit(port_problem((few,), model, (1.0,)), np.array(model.typical), tolerance=_ROUGH)
        return found.residuals if few is self else self.data - self.observation(model).fitted(found.values)

    @property
    def _rest_current(self) -> float:
        """The current at the onset [A] by the readings at rest, 0 without."""
        rest = self.channel.at_rest
        return rest.position(rest.slope if self.drifts else 0.0) if rest.count >= LEAST_REST else 0.0

    def start(self, kind: ElectricalModel, held: float) -> Array:
        """Return starting values (n,) of a model, Re ``held`` [ohm]."""
        t, data, offset = self.since, self.data, self._rest_current
        stored = self.nuisance[t >= 0, int(self.has_offset) :]
        try:
            return self._model_start(kind, t[t >= 0], data[t >= 0] - offset, held, stored)
        except FewerRelaxations as error:
            raise InputError(f"{self.source}: {error}, or {argument('model', 'auto')}") from error
        except InputError as error:
            raise InputError(
                f"{self.source}: {error}, from {self.channel.zero:.6g} s on: look at the clamp, and at the columns of "
                f"voltage and current (which is which, their signs and units), or state {argument('onset')}"
            ) from error

    def _model_start(self, kind: ElectricalModel, t: Array, values: Array, held: float, stored: Array) -> Array:
        return model_start(kind, t, values, self.drive.from_rest(), held, stored)
