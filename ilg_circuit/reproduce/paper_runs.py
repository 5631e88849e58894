"""Computes runs that several items share, each once, on first use."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ..arrays import Array
from ..drive import PiecewiseLinear
from ..files import csv_text
from ..oscillators.network import INHIBITION, Network, ring, unit
from ..oscillators.outcome import Rhythm
from ..oscillators.rhythm import rhythm
from ..simulation.response import Response, simulate
from ..strip.actuator import PAPER, Actuator, Coupling
from .published import published

if TYPE_CHECKING:
    from ..identification import Identification

#: The paper's step [V], and the time [s] after which its current was steady.
VOLTAGE, DURATION = 4.0, 300.0
#: Rest [s] before the step, in a record made from the fitted curves.
_BEFORE = 5.0


def coefficient(item: str) -> float:
    """Return a coefficient of EC (30), (35)-(39) as printed, in its own unit."""
    return float(published("ec_curves", item).printed)


def printed_current(t: Array) -> Array:
    """Return EC (30) [A] at t >= 0, as printed."""
    a0, a1, rate = (coefficient(f"step_current_{name}") for name in ("steady", "decaying", "rate"))
    return a0 + a1 * np.exp(-rate * t)


def printed_displacement(t: Array) -> Array:
    """Return EC (35) [m] at t >= 0, as printed (in mm)."""
    steady, cosine, sine, decay, frequency = (
        coefficient(f"displacement_{name}") for name in ("steady", "cosine", "sine", "decay", "frequency")
    )
    swing = cosine * np.cos(frequency * t) + sine * np.sin(frequency * t)
    return np.asarray(1e-3 * (steady - np.exp(-decay * t) * swing))


class PaperRuns:
    """Solves of the paper's strip under its 4 V step, identifications, and the paper's rhythm."""

    @cached_property
    def free(self) -> Response:
        """Return EC (30), (34) by ngspice: the massless strip with a free tip, sampled finely for the peak."""
        return simulate(PAPER, PiecewiseLinear.step(VOLTAGE), np.linspace(0.0, DURATION, 6001), beam="static")

    @cached_property
    def clamped(self) -> Response:
        """EC (38) by ngspice: as `free`, with a clamped tip."""
        return simulate(
            PAPER, PiecewiseLinear.step(VOLTAGE), np.linspace(0.0, DURATION, 601), beam="static", tip="clamped"
        )

    @cached_property
    def curves(self) -> Array:
        """Return EC (30) and (35) as a record (t, 4): samples of the paper's fitted curves, not a measurement."""
        t = np.arange(-_BEFORE, 401.0)
        after = np.maximum(t, 0.0)
        waves = (VOLTAGE, printed_current(after), printed_displacement(after))
        return np.column_stack([t + _BEFORE, *((t >= 0) * wave for wave in waves)])

    @cached_property
    def files(self) -> dict[str, str]:
        """Return that record as file name -> text."""
        headers = ("time_s", "voltage_V", "current_A", "displacement_m")
        return {"EC-curves.csv": csv_text(dict(zip(headers, self.curves.T, strict=True)))}

    @cached_property
    def from_curves(self) -> Identification:
        """The strip identified from the paper's fitted curves, simulated by ngspice."""
        return _identified("EC (30) and (35)", self.curves)

    @cached_property
    def from_run(self) -> Identification:
        """The strip identified from our own run, to test that `identify` recovers its parameters."""
        r = self.free
        step = np.column_stack([r.time + _BEFORE, r.voltage, r.current, r.displacement])[::20]
        rest = np.zeros((int(_BEFORE), 4))
        rest[:, 0] = np.arange(len(rest))
        return _identified("our run", np.concatenate([rest, step]))

    @cached_property
    def fitted_coupling(self) -> Coupling:
        """d(s) identified from our own displacement curve."""
        return coupling_of(self.from_run.actuator)

    @cached_property
    def two_period(self) -> float:
        """Period [s] of the unit of two neurons."""
        return period_of(rhythm(self.network(2)))

    def network(self, neurons: int = 3, inhibition: float = INHIBITION, **constants: Any) -> Network:
        """CPG §6.3: three neurons in a ring, or the unit of two; a = 2.5 is assumed."""
        return unit(inhibition, **constants) if neurons == 2 else ring(neurons, inhibition, **constants)


def coupling_of(actuator: Actuator) -> Coupling:
    """Return the d(s) of a strip that is known to have one."""
    assert isinstance(actuator.coupling, Coupling)
    return actuator.coupling


def period_of(found: Rhythm) -> float:
    """Return the period [s] of a rhythm that is known to have one."""
    assert found.period is not None
    return found.period


def _identified(source: str, record: Array) -> Identification:
    """From a ``record`` of time, voltage, current, displacement (t, 4) [SI]."""
    from ..identification import identify
    from ..measurements.prepare import prepare
    from ..measurements.table import Table

    columns = dict(zip(("time", "voltage", "current", "displacement"), record.T, strict=True))
    return identify(prepare(Table(columns, source), "first-level"), base=PAPER, model="rc")
