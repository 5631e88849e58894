"""A strip as a sensor: its tip is moved, and its terminals answer with a voltage or a current."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..circuit.strip import sensor_netlist
from ..drive import Drive, drive_times
from ..files import write_text
from ..solve.transient import Progress, require_times, transient
from ..strip.actuator import Actuator
from ..units import format_quantity
from .response import ACCEPTABLE, SIMULATION_ACCURACY, transient_band

Array = NDArray[np.float64]

#: attribute -> (column of a CSV file, SI unit)
COLUMNS = {
    "time": ("time_s", "s"),
    "displacement": ("displacement_m", "m"),
    "voltage": ("voltage_V", "V"),
    "current": ("current_A", "A"),
    "force": ("force_N", "N"),
    "charge": ("charge_C", "C"),
}


@dataclass(frozen=True)
class Sensed:
    """Waveforms at ``time`` [s] (n,), each (n,), positive towards the anode where they are mechanical.

    ``displacement`` [m] imposed on L_F; ``voltage`` [V] at the terminals and ``current`` [A] into the plus pin, one of
    the two zero; elastic ``force`` [N] of the strip; ``charge`` [C] on the ion path.
    """

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

    def write_csv(self, path: str | Path) -> None:
        """The columns with full precision."""
        rows = [",".join(column for column, _ in COLUMNS.values())]
        table = np.column_stack([getattr(self, name) for name in COLUMNS]).tolist()
        rows += [",".join(map(repr, row)) for row in table]
        write_text(Path(path), "\n".join(rows) + "\n")

    def summary(self) -> str:
        """For each quantity its largest value, and when."""
        lines = [f"{'quantity':<14}{'largest':>16}{'at':>12}"]
        for name, (_, unit) in list(COLUMNS.items())[1:]:
            values = getattr(self, name)
            k = int(np.argmax(np.abs(values)))
            value, when = format_quantity(float(values[k]), unit, 5), format_quantity(float(self.time[k]), "s", 4)
            lines.append(f"{name:<14}{value:>16}{when:>12}")
        return "\n".join(lines)


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
    """What the strip's ``terminals`` ("open" or "short") show while L_F follows ``motion`` [m], from rest.

    Sampled at ``times`` [s] (ascending, >= 0). See `ilg_circuit.circuit.strip.sensor_netlist`; errors as there.
    """
    samples = np.asarray(times, dtype=np.float64)
    require_times(samples)
    samples = drive_times(motion, samples)
    netlist = sensor_netlist(actuator, terminals=terminals, band=transient_band(samples))
    waves = transient(
        netlist,
        motion,
        samples,
        engine=engine,
        accuracy=SIMULATION_ACCURACY if accuracy is None else accuracy,
        acceptable=ACCEPTABLE if accuracy is None else accuracy,
        interpolate=False,
        progress=progress,
    )
    nothing = np.zeros(len(samples))
    answers = {name: waves.output(name) if name in waves.names else nothing for name in ("voltage", "current")}
    return Sensed(
        actuator=actuator,
        motion=motion,
        terminals=terminals,
        time=samples,
        displacement=motion.value(samples),
        force=waves.output("force"),
        charge=waves.output("charge"),
        error=float(waves.errors.max()),
        engine=waves.engine,
        **answers,
    )
