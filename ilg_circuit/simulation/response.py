"""Simulates a strip under a drive: current, charge, displacement, force and energy over time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arrays import Array, plain
from ..circuit.netlist import Netlist
from ..circuit.strip import Load, strip_netlist
from ..drive import Drive, drive_findings
from ..errors import InputError
from ..files import write_csv
from ..findings import Finding, sentences
from ..result import Column
from ..solve.grid import smooth_intervals
from ..solve.state_space import state_space
from ..solve.transient import Progress, sampled_times, transient
from ..strip.actuator import Actuator
from ..strip.ladder import LADDER_BAND
from ..strip.validity import run_warnings
from ..units import require_plausible
from .energy import EnergyAccount, account, probes
from .waveforms import WAVEFORMS, Simulated, Solution

#: Accuracy of a simulation, relative to each waveform's maximum; tight, so that small samples are good as well.
SIMULATION_ACCURACY = 1e-9
#: Accuracy of a circuit with nonlinear elements, whose laws have kinks.
NONLINEAR_ACCURACY = 1e-6
#: Error accepted, and reported, when no accuracy was requested.
ACCEPTABLE = 5e-6

# three-point Gauss-Legendre: nodes in (0, 1) and weights
#: A run beyond this times the largest voltage of the fit is an extrapolation.
_BEYOND = 1.1
_GAUSS_NODES = np.array([0.5 - np.sqrt(0.15), 0.5, 0.5 + np.sqrt(0.15)])
_GAUSS_WEIGHTS = np.array([5.0, 8.0, 5.0]) / 18


@dataclass(frozen=True, repr=False, eq=False)
class Response(Simulated):
    """What a strip does under a ``drive``; `waveforms.WAVEFORMS` lists its waveforms.

    ``voltage`` at the terminals, ``current`` into them, ``charge`` on the ionic capacitors, ``displacement`` and
    ``force`` at L_F, positive towards the anode (NaN without a coupling), ``energy`` delivered by the source since
    t = 0, ``account`` where it went. ``stderr`` (n,) are standard errors by waveform, where a band was asked for.
    """

    presenter: ClassVar[str] = "response"
    drive: Drive
    netlist: Netlist
    account: EnergyAccount
    stderr: Mapping[str, Array] = field(default_factory=dict)

    def with_waveforms(self, **changed: Array) -> Response:
        """Return the response with some waveforms in place of its own."""
        return replace(self, waveforms={**self.waveforms, **changed})

    @property
    def warnings(self) -> list[str]:
        """What the drive's file leaves open, and assumptions that fail in this run, with number and consequence."""
        displacement = float(np.nanmax(np.abs(self.displacement), initial=0.0))
        voltage = float(np.abs(self.voltage).max())
        told = sentences([*drive_findings(self.drive), *beyond_fit(self.actuator, voltage)])
        return [*told, *run_warnings(self.actuator, self.drive, float(self.time[-1]), voltage, displacement)]

    def table(self) -> tuple[Column, ...]:
        """Return time and waveforms (n,), then the standard errors."""
        errors = (Column(f"{name}_stderr", error, WAVEFORMS[name].unit) for name, error in self.stderr.items())
        return (*super().table(), *errors)

    def write_csv(self, path: str | Path, *, energy: bool = False) -> None:
        """Write the command's CSV file, blanks for NaN, ``energy`` as its last column if asked; `save` writes all."""
        left_out = {w.column for w in WAVEFORMS.values() if w.on_request and not energy}
        write_csv(path, {header: values for header, values in self.columns().items() if header not in left_out})

    def to_dict(self) -> dict[str, Any]:
        """Return the response as plain data; waveforms are lists by header, None for NaN."""
        return {
            "actuator": self.actuator.name,
            "drive": self.drive.text,
            "circuit": self.netlist.title,
            "engine": self.engine,
            "estimated_error": self.error,
            "waveforms": {header: plain(values) for header, values in self.columns().items()},
            "account": self.account.to_dict(),
            "warnings": self.warnings,
        }


def sample_times(duration: float, *, samples: int | None = None, step: float | None = None) -> Array:
    """Return sample times from 0 to ``duration`` [s]: ``samples`` of them (default 601), or one every ``step`` [s].

    Raises InputError for values that give no sensible grid (2 to 2000000 samples).
    """
    if not (np.isfinite(duration) and duration > 0):
        raise InputError(f"duration {duration:g} s must be more than zero")
    require_plausible("--duration", duration, "s")
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
    beam: str | None = None,
    load: Load | None = None,
    engine: str = "ngspice",
    accuracy: float | None = None,
    progress: Progress | None = None,
) -> Response:
    """Return the strip's response to ``drive`` from rest, sampled at ``times`` [s] (ascending, >= 0).

    See `ilg_circuit.circuit.strip.strip_netlist` for ``tip``, ``beam`` and ``load``, and
    `ilg_circuit.solve.transient.transient` for ``engine``, ``accuracy`` (default 1e-9; 1e-6 with nonlinear elements)
    and the errors raised.
    """
    samples = sampled_times(drive, times)
    netlist = strip_netlist(actuator, tip=tip, beam=beam, load=load, band=transient_band(samples))
    acceptable = ACCEPTABLE if accuracy is None else accuracy
    if accuracy is None:
        accuracy = SIMULATION_ACCURACY if netlist.linear else NONLINEAR_ACCURACY
    poles = np.concatenate([state_space([netlist.linearised(u)]).poles().ravel() for u in {0.0, drive.largest()}])
    intervals = smooth_intervals(poles, drive, float(samples[-1]) or 1e-300)
    ends = np.union1d(samples, intervals[intervals <= samples[-1]])
    grid, gauss, weights = _energy_grid(samples, ends)
    probed = replace(netlist, outputs=netlist.outputs + probes(netlist))
    waveforms = transient(
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

    solution = Solution(drive, samples, waveforms, at, integrate)
    values = {name: waveform.of(solution) for name, waveform in WAVEFORMS.items()}
    return Response(
        actuator=actuator,
        drive=drive,
        netlist=netlist,
        time=samples,
        waveforms=values,
        account=account(netlist, waveforms, values["energy"], integrate, at),
        error=float(waveforms.errors.max()),
        engine=waveforms.engine,
    )


def transient_band(times: Array) -> tuple[float, float]:
    """Return the band [Hz] that samples at ``times`` [s] resolve, for the ladders of a transient, within `LADDER_BAND`.

    From a tenth of the frequency that the whole run resolves to twenty times the one of the closest samples.
    """
    low, high = LADDER_BAND
    if len(times) < 2:
        return low, high
    lowest = min(0.1 / float(times[-1]), high / 100)
    return lowest, min(max(20 / float(np.diff(times).min()), 100 * lowest), max(high, 100 * lowest))


def _energy_grid(samples: Array, ends: Array) -> tuple[Array, NDArray[np.intp], Array]:
    """Return solve times (samples and Gauss points between ``ends``), indices (intervals, 3) of the latter, weights.

    The energy is the integral of u i; three Gauss points in every smooth interval make it as good as the waveforms,
    where sums over the samples would not be.
    """
    widths = np.diff(ends)[:, None]
    points = ends[:-1, None] + widths * _GAUSS_NODES
    grid = np.union1d(samples, points.ravel())
    return grid, np.searchsorted(grid, points), widths * _GAUSS_WEIGHTS


def beyond_fit(actuator: Actuator, voltage: float) -> list[Finding]:
    """Return a finding where ``voltage`` [V] is larger than any that the strip was fitted at."""
    fitted = actuator.uncertainty.voltage if actuator.uncertainty is not None else None
    if fitted is None or voltage <= _BEYOND * fitted:
        return []
    return [Finding("beyond-fitted-voltage", values={"voltage": voltage, "fitted": fitted})]
