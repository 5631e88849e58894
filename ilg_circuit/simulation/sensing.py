"""Simulates a strip as a sensor: its tip is moved, and its terminals answer with a voltage or a current."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import plain
from ..circuit.strip import sensor_netlist
from ..drive import Drive, drive_findings
from ..findings import sentences
from ..solve.sampling import sampled_times
from ..solve.transient import Progress, transient
from ..strip.actuator import Actuator
from .response import ACCEPTABLE, SIMULATION_ACCURACY, transient_band
from .waveforms import Simulated

#: Columns of a CSV file after the time, by their names in `waveforms.WAVEFORMS`.
SENSED = ("displacement", "voltage", "current", "force", "charge")


@dataclass(frozen=True, repr=False, eq=False)
class Sensed(Simulated):
    """The electrical answer of a strip whose tip is moved, as `ilg_circuit.sense` returns it.

    Mechanical quantities are positive towards the anode.

    Attributes
    ----------
    time : ndarray (n,)
        Times [s].
    displacement : ndarray (n,)
        Displacement imposed at L_F [m].
    voltage, current : ndarray (n,)
        Voltage between the terminals [V] and current into plus [A]; one of them is zero.
    force : ndarray (n,)
        Elastic force of the strip [N].
    charge : ndarray (n,)
        Charge on the ion path [C].
    actuator : Actuator
        The strip.
    motion : Drive
        The motion over time.
    terminals : str
        "open" or "short".
    error : float
        Estimated error, relative to the largest value of each waveform.
    engine : str
        What solved the circuit.
    """

    presenter: ClassVar[str] = "sensing"
    motion: Drive
    terminals: str

    @property
    def warnings(self) -> tuple[str, ...]:
        """Assumptions about the motion that its file does not state."""
        return sentences(drive_findings(self.motion))

    def to_dict(self) -> dict[str, Any]:
        """Return the result as plain data; waveforms are lists by header."""
        return {
            "actuator": self.actuator.name,
            "motion": self.motion.text,
            "terminals": self.terminals,
            "engine": self.engine,
            "estimated_error": self.error,
            "waveforms": {header: plain(values) for header, values in self.columns().items()},
            "warnings": list(self.warnings),
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
    samples = sampled_times(motion, times)
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
    silent = dict.fromkeys(("voltage", "current"), np.zeros(len(samples)))
    solved = silent | {name: waveforms.output(name) for name in waveforms.names}
    solved["displacement"] = motion.value(samples)
    return Sensed(
        actuator=actuator,
        motion=motion,
        terminals=terminals,
        time=samples,
        waveforms={name: solved[name] for name in SENSED},
        error=float(waveforms.errors.max()),
        engine=waveforms.engine,
    )
