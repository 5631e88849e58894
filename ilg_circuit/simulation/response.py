"""A strip under a drive: waveforms -> current, charge, displacement, force, energy; as arrays, table and CSV."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..circuit.netlist import Netlist
from ..circuit.strip import Load, strip_netlist
from ..drive import Drive, drive_times
from ..errors import InputError
from ..files import write_text
from ..solve.grid import smooth_intervals
from ..solve.state_space import state_space
from ..solve.transient import Progress, require_times, transient
from ..strip.actuator import Actuator
from ..strip.ladder import LADDER_BAND
from ..strip.validity import run_warnings
from ..units import format_quantity
from .energy import EnergyAccount, account, probes

Array = NDArray[np.float64]

#: name of the attribute -> (column of a CSV file, SI unit)
COLUMNS = {
    "time": ("time_s", "s"),
    "voltage": ("voltage_V", "V"),
    "current": ("current_A", "A"),
    "displacement": ("displacement_m", "m"),
    "force": ("force_N", "N"),
    "charge": ("charge_C", "C"),
    "energy": ("energy_J", "J"),
}

#: Accuracy of a simulation, relative to each waveform's maximum; tight, so that small samples are good as well.
SIMULATION_ACCURACY = 1e-9
#: That of a circuit with nonlinear elements, whose laws have kinks.
NONLINEAR_ACCURACY = 1e-6
#: Where nobody asked for an accuracy, a result with this error, which is stated, is one too.
ACCEPTABLE = 5e-6

# three-point Gauss-Legendre: nodes in (0, 1) and weights
_GAUSS_NODES = np.array([0.5 - np.sqrt(0.15), 0.5, 0.5 + np.sqrt(0.15)])
_GAUSS_WEIGHTS = np.array([5.0, 8.0, 5.0]) / 18


@dataclass(frozen=True)
class Response:
    """Waveforms at ``time`` [s] (n,), each (n,), SI: ``voltage`` at the terminals, ``current`` into them, ``charge`` on
    the ionic capacitors, ``displacement`` and ``force`` at L_F, positive towards the anode (NaN without a coupling),
    ``energy`` delivered by the source since t = 0, ``account`` where it went. ``error`` is the estimated error of the
    worst waveform relative to its maximum.
    """

    actuator: Actuator
    drive: Drive
    netlist: Netlist
    time: Array
    voltage: Array
    current: Array
    displacement: Array
    force: Array
    charge: Array
    energy: Array
    account: EnergyAccount
    error: float
    engine: str

    @property
    def warnings(self) -> list[str]:
        """Assumptions of the model that fail in this run, each with its number and the consequence."""
        displacement = float(np.nanmax(np.abs(self.displacement), initial=0.0))
        voltage = float(np.abs(self.voltage).max())
        return run_warnings(self.actuator, self.drive, float(self.time[-1]), voltage, displacement)

    def write_csv(self, path: str | Path, *, energy: bool = False, stderr: dict[str, Array] | None = None) -> None:
        """Write the columns with full precision, blanks for NaN.

        ``energy`` adds a column energy_J, ``stderr`` one for each standard error in it, such as current_stderr_A.
        """
        names = [n for n in COLUMNS if energy or n != "energy"]
        extra = stderr or {}
        titles = [COLUMNS[n][0] for n in names] + [f"{n}_stderr_{COLUMNS[n][1]}" for n in extra]
        rows = [",".join(titles)]
        table = np.column_stack([*(getattr(self, n) for n in names), *extra.values()]).tolist()
        rows += [",".join("" if v != v else repr(v) for v in row) for row in table]
        write_text(Path(path), "\n".join(rows) + "\n")

    def summary(self) -> str:
        """A small table: for each quantity its value at the end, its largest, and when."""
        lines = [f"{'quantity':<14}{'at the end':>16}{'largest':>16}{'at':>12}"]
        for name, (_, unit) in list(COLUMNS.items())[1:]:
            values = getattr(self, name)
            if np.isnan(values).all():
                lines.append(f"{name:<14}{'not known':>16}   the actuator has no [coupling]")
                continue
            peak = int(np.argmax(np.abs(values)))
            cells = [format_quantity(float(values[k]), unit, 5) for k in (-1, peak)]
            lines.append(f"{name:<14}{cells[0]:>16}{cells[1]:>16}{format_quantity(float(self.time[peak]), 's', 4):>12}")
        return "\n".join(lines)


def sample_times(duration: float, *, samples: int | None = None, step: float | None = None) -> Array:
    """Sample times from 0 to ``duration`` [s]: ``samples`` of them (default 601), or one every ``step`` [s].

    Raises InputError for values that give no sensible grid (2 to 2000000 samples).
    """
    if not (np.isfinite(duration) and duration > 0):
        raise InputError(f"duration {duration:g} s must be more than zero")
    if step is not None:
        if samples is not None:
            raise InputError("give either a number of samples or a step, not both")
        if not 0 < step <= duration:
            raise InputError(f"step {step:g} s must be more than zero and at most the duration {duration:g} s")
        if duration / step > 2_000_000:
            raise InputError(f"step {step:g} s makes {duration / step:.3g} samples; at most 2000000 are possible")
        count = int(np.floor(duration / step * (1 + 1e-12)))
        times: Array = np.asarray(np.arange(count + 1) * step, dtype=np.float64)
        return times if duration - times[-1] <= 1e-9 * step else np.append(times, duration)
    samples = 601 if samples is None else samples
    if not 2 <= samples <= 2_000_000:
        raise InputError(f"{samples} samples: give 2 to 2000000")
    return np.linspace(0.0, duration, samples)


def simulate(
    actuator: Actuator,
    drive: Drive,
    times: ArrayLike,
    *,
    tip: str = "free",
    beam: str = "dynamic",
    load: Load | None = None,
    engine: str = "ngspice",
    accuracy: float | None = None,
    progress: Progress | None = None,
) -> Response:
    """The strip's response to ``drive`` from rest, sampled at ``times`` [s] (ascending, >= 0).

    See `ilg_circuit.circuit.strip.strip_netlist` for ``tip``, ``beam`` and ``load``, and
    `ilg_circuit.solve.transient.transient` for ``engine``, ``accuracy`` (default 1e-9; 1e-6 with nonlinear elements)
    and the errors raised.
    """
    samples = np.asarray(times, dtype=np.float64)
    require_times(samples)
    samples = drive_times(drive, samples)
    netlist = strip_netlist(actuator, tip=tip, beam=beam, load=load, band=transient_band(samples))
    acceptable = ACCEPTABLE if accuracy is None else accuracy
    if accuracy is None:
        accuracy = SIMULATION_ACCURACY if netlist.linear else NONLINEAR_ACCURACY
    poles = np.concatenate([state_space([netlist.linearised(u)]).poles().ravel() for u in {0.0, drive.largest()}])
    intervals = smooth_intervals(poles, drive, float(samples[-1]) or 1e-300)
    ends = np.union1d(samples, intervals[intervals <= samples[-1]])
    grid, gauss, weights = _energy_grid(samples, ends)
    probed = replace(netlist, outputs=netlist.outputs + probes(netlist))
    waves = transient(
        probed,
        drive,
        grid,
        engine=engine,
        accuracy=accuracy,
        acceptable=acceptable,
        interpolate=False,
        progress=progress,
    )
    at = np.searchsorted(grid, samples)

    def integrate(power: Array) -> Array:
        steps = np.concatenate([[0.0], np.cumsum((power[gauss] * weights).sum(axis=1))])
        return np.asarray(steps[np.searchsorted(ends, samples)])

    energy = integrate(drive.value(grid) * waves.output("current"))
    unknown = np.full(len(samples), np.nan)
    mechanical = {n: waves.output(n)[at] if n in waves.names else unknown for n in ("displacement", "force")}
    return Response(
        actuator=actuator,
        drive=drive,
        netlist=netlist,
        time=samples,
        voltage=drive.value(samples),
        current=waves.output("current")[at],
        charge=waves.output("charge")[at],
        energy=energy,
        account=account(netlist, waves, energy, integrate, at),
        error=float(waves.errors.max()),
        engine=waves.engine,
        **mechanical,
    )


def transient_band(times: Array) -> tuple[float, float]:
    """Band [Hz] that samples at ``times`` [s] can tell of, for the ladders of a transient, within `LADDER_BAND`.

    A tenth of what the whole run resolves to twenty times what the closest samples do.
    """
    low, high = LADDER_BAND
    if len(times) < 2:
        return low, high
    lowest = min(0.1 / float(times[-1]), high / 100)
    return lowest, min(max(20 / float(np.diff(times).min()), 100 * lowest), max(high, 100 * lowest))


def _energy_grid(samples: Array, ends: Array) -> tuple[Array, NDArray[np.intp], Array]:
    """Solve times (samples and Gauss points between ``ends``), indices (intervals, 3) of the latter, their weights.

    The energy is the integral of u i; three Gauss points in every smooth interval make it as good as the waveforms,
    where sums over the samples would not be.
    """
    widths = np.diff(ends)[:, None]
    points = ends[:-1, None] + widths * _GAUSS_NODES
    grid = np.union1d(samples, points.ravel())
    return grid, np.searchsorted(grid, points), widths * _GAUSS_WEIGHTS
