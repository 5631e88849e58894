"""Simulates a strip as a sensor: its tip is moved, and its terminals answer with a voltage or a current."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array, plain
from ..circuit.strip import sensor_netlist
from ..drive import Drive, drive_times
from ..files import write_csv
from ..result import Result
from ..solve.transient import Progress, require_times, transient
from ..strip.actuator import Actuator
from .response import ACCEPTABLE, SIMULATION_ACCURACY, transient_band
from .waveforms import WAVEFORMS

#: Columns of a CSV file after the time, by their names in `waveforms.WAVEFORMS`.
SENSED = ("displacement", "voltage", "current", "force", "charge")


@dataclass(frozen=True)
class Sensed(Result):
    """Waveforms at ``time`` [s] (n,), each (n,), positive towards the anode where they are mechanical.

    ``displacement`` [m] imposed on L_F; ``voltage`` [V] at the terminals and ``current`` [A] into the plus pin, one of
    the two zero; elastic ``force`` [N] of the strip; ``charge`` [C] on the ion path.
    """

    presenter: ClassVar[str] = "sensing"
    actuator: Actuator
    motion: Drive
    terminals: str
    time: Array
    displacement: Array
    voltage: Array
    current: Array
    force: Array
    charge: Array
    error: float
    engine: str

    def columns(self) -> dict[str, Array]:
        """Return time and waveforms (n,) by their headers, such as voltage_V."""
        return {"time_s": self.time} | {WAVEFORMS[name].column: getattr(self, name) for name in SENSED}

    def write_csv(self, path: str | Path) -> None:
        """Write the columns with full precision."""
        write_csv(path, self.columns())

    def to_dict(self) -> dict[str, Any]:
        """Return the result as plain data; waveforms are lists by header."""
        return {
            "actuator": self.actuator.name,
            "motion": self.motion.text,
            "terminals": self.terminals,
            "engine": self.engine,
            "estimated_error": self.error,
            "waveforms": {header: plain(values) for header, values in self.columns().items()},
        }


def sense(
    actuator: Actuator,
    motion: Drive,
    times: ArrayLike,
    *,
    terminals: str = "open",
    engine: str = "ngspice",
    accuracy: float | None = None,
    progress: Progress | None = None,
) -> Sensed:
    """Return what the strip's ``terminals`` ("open" or "short") show while L_F follows ``motion`` [m], from rest.

    Sampled at ``times`` [s] (ascending, >= 0). See `ilg_circuit.circuit.strip.sensor_netlist`; errors as there.
    """
    samples = np.asarray(times, dtype=np.float64)
    require_times(samples)
    samples = drive_times(motion, samples)
    netlist = sensor_netlist(actuator, terminals=terminals, band=transient_band(samples))
    waveforms = transient(
        netlist,
        motion,
        samples,
        engine=engine,
        accuracy=SIMULATION_ACCURACY if accuracy is None else accuracy,
        acceptable=ACCEPTABLE if accuracy is None else accuracy,
        interpolate=False,
        progress=progress,
    )
    zero = np.zeros(len(samples))
    voltage, current = (waveforms.output(name) if name in waveforms.names else zero for name in ("voltage", "current"))
    return Sensed(
        actuator=actuator,
        motion=motion,
        terminals=terminals,
        time=samples,
        displacement=motion.value(samples),
        voltage=voltage,
        current=current,
        force=waveforms.output("force"),
        charge=waveforms.output("charge"),
        error=float(waveforms.errors.max()),
        engine=waveforms.engine,
    )
