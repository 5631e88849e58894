"""The measured voltage of a record whose current was controlled, as an observation of the port."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..arrays import Array
from ..circuit.strip import port_netlist
from ..errors import InputError
from ..measurements.record import Channel, Forced, Record
from ..measurements.voltage import MeasuredDrive
from ..solve.transient import transient
from ..strip.models import ElectricalModel
from ..strip.port import Port
from ..units import format_quantity
from .current import CurrentData
from .port_response import Response
from .start import model_start


@dataclass(frozen=True)
class VoltageData(CurrentData):
    """The voltage of a record over time since the onset [s], under the current that a source forced; see `CurrentData`.

    The current is known as it was set; the voltage has the noise, so its residuals are made least.
    """

    quantity = "voltage"
    unit = "V"

    @property
    def _forced(self) -> Forced:
        assert self.record.forced is not None
        return self.record.forced

    @property
    def channel(self) -> Channel:
        """The voltage, with its bracket of the onset."""
        return self._forced.voltage

    @property
    def measured(self) -> MeasuredDrive:
        """The current that was forced."""
        return replace(self._forced.drive, places=self.places)

    @property
    def voltage(self) -> float:
        """Largest voltage that answered [V], with its sign."""
        values = self.channel.values
        return float(values[np.argmax(np.abs(values))])

    @property
    def level(self) -> float | None:
        """No voltage is constant under a current."""
        return None

    @property
    def response(self) -> Response:
        return Response(self.drive, by_current=True)

    def _solved(self, ports: Sequence[Port], t: Array) -> Array:
        after = t >= 0
        result = np.repeat(self.response.at_rest(ports)[:, None], len(t), axis=1)
        netlists = [port_netlist(port, by_current=True) for port in ports]
        accuracy = self.accuracy
        found = transient(
            netlists, self.drive, t[after], engine=self.engine, accuracy=accuracy, acceptable=10 * accuracy
        )
        result[:, after] = found.values[:, found.names.index("voltage")]
        return result

    def _model_start(self, kind: ElectricalModel, t: Array, values: Array, held: float, stored: Array) -> Array:
        """Return starting values from the voltage as a drive; where that is too noisy, from its ends alone."""
        forced = self.drive.value(t) - self.drive.rest
        try:
            return model_start(kind, t, forced, self.record.drive.from_rest(), held)
        except InputError:
            k = int(np.argmax(np.abs(values)))
            steady = abs(values[k] / (forced[k] or 1.0))
            fast = max(min(abs(values[0] / (forced[0] or 1.0)), 0.5 * steady) - held, 1e-3 * steady)
            count = kind.ions.branch_counts[-1]
            slow = float(t[-1]) / (steady + fast)
            shares = np.geomspace(1.0, 0.05 ** (count - 1), count)
            pairs = [(fast * count, slow * share / count) for share in sorted(shares)]
            return kind.starts_from_branches(1.5 * steady, pairs, float(np.abs(values).max()))

    def may_be_open(self, kind: ElectricalModel) -> bool:
        return False  # a steady current needs a path

    def require_electrode_resistance(self, held: float) -> None:
        if not (math.isfinite(held) and held >= 0):
            raise InputError(f"electrode resistance {held:g} ohm must be zero or more")
        after = self.channel.time >= 0
        t, u = self.channel.time[after], self.channel.values[after]
        i = self.measured.drive.value(t)
        k = int(np.argmax(np.abs(u)))
        if held and held * abs(i[k]) >= abs(u[k]):
            raise InputError(
                f"electrode resistance {held:g} ohm is too large: the largest voltage of "
                f"{format_quantity(abs(u[k]), 'V', 4)} allows less than {abs(u[k] / i[k]):.4g} ohm"
            )


def record_data(record: Record, engine: str, source: str) -> CurrentData:
    """Return what is fitted of a ``record``: its current, or its voltage where the current was controlled."""
    return (CurrentData if record.forced is None else VoltageData)(record, engine, source)
