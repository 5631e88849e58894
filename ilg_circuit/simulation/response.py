"""Simulates a strip under a drive: current, charge, displacement, force and energy over time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array, plain
from ..circuit.line_response import chosen_layout
from ..circuit.load import Load
from ..circuit.netlist import Netlist
from ..circuit.strip import strip_netlist
from ..circuit.wiring import Wiring
from ..drive import Drive, by_current, drive_findings, each, voltage_limit
from ..errors import InputError, argument
from ..files import write_csv
from ..findings import Finding, sentences
from ..result import Column
from ..solve.sampling import sampled_times
from ..solve.transient import Progress, transient
from ..strip.actuator import Actuator
from ..strip.couplings import RelaxingCoupling
from ..strip.ladder import LADDER_BAND
from ..strip.models import LadderPath
from ..strip.validity import run_warnings
from ..units import require_plausible
from .compared import Compared
from .curvature import Curvatures, along_segments, cell_curvatures, curvature_probe, curvatures
from .energy import EnergyAccount, account, probes, works
from .ladder_error import ladder_error
from .shape import POINTS, Shape, static_shape
from .waveforms import WAVEFORMS, Simulated, Solution

if TYPE_CHECKING:
    from .check import Difference

#: Accuracy of a simulation, relative to each waveform's maximum; tight, so that small samples are good as well.
SIMULATION_ACCURACY = 1e-9
#: Accuracy of a circuit with nonlinear elements, whose laws have kinks.
NONLINEAR_ACCURACY = 1e-6
#: Error accepted, and reported, when no accuracy was requested.
ACCEPTABLE = 5e-6

#: Error by the size of a line's cells above which a run warns of it.
COARSE = 0.01
#: Outputs of the segments, before their number.
_SEGMENTS = ("voltage_", "current_")
#: Units of the columns of segments.
_SEGMENT_UNITS = {"voltage": "V", "current": "A", "curvature": "1/m", "angle": "rad"}
#: Width of the band of a run's ladders: faster relaxations are instantaneous.
_RESOLVED = 1e5
#: Number of samples above which they are interpolated between points of the solve.
_MANY_SAMPLES = 1000
#: Ratio to the largest voltage of the fit above which a run is an extrapolation.
_BEYOND = 1.1


@dataclass(frozen=True, repr=False, eq=False)
class Response(Simulated):
    """The response of a strip to a drive: waveforms over time, as `ilg_circuit.simulate` returns them.

    Displacement and force are taken at L_F, positive towards the anode, and NaN for a strip without a coupling.

    Attributes
    ----------
    time : ndarray (n,)
        Times [s].
    voltage, current : ndarray (n,)
        Voltage at the terminals [V] and current into them [A].
    displacement, force : ndarray (n,)
        Displacement [m] and force on the load or the clamp [N].
    charge : ndarray (n,)
        Charge on the ionic capacitors [C].
    energy : ndarray (n,)
        Energy delivered by the source since t = 0 [J].
    account : EnergyAccount
        Where the energy went: stored, dissipated, done as work.
    actuator : Actuator
        The strip.
    drive : Drive
        The voltage, or the current, over time.
    error : float
        Estimated error, relative to the largest value of each waveform.
    engine : str
        What solved the circuit: "ngspice" or "exact".
    netlist : Netlist
        The circuit that was solved.
    stderr : mapping of str to ndarray (n,)
        Standard errors by waveform, if ``band=True`` was asked for.
    compared : tuple of Compared
        Predictions beside measured waveforms, if ``compare`` was given.
    checks : tuple of Difference
        Differences from the other engine and the closed forms, if ``check=True`` was asked for.
    curvatures : Curvatures or None
        Free curvature along the strip, from which `ilg_circuit.shape` computes its shape: one cell, or those of a strip
        with electrodes; None without a coupling.
    wires : Wiring or None
        Which segments of a strip with electrodes are driven, at 0 V or open; None for one source for all.
    segments : mapping of str to ndarray (n,)
        Of a strip with several segments "voltage_1" [V], "current_1" [A], ...: at and into each segment of side 1. Of
        one with electrodes "curvature_1" [1/m], ..., the mean free curvature of each segment of side 1, and "angle"
        [rad], that of the free end as these bend it, without weight and load.
    cells_error : float
        Estimated error by the size of these cells, which is part of ``error``.
    warnings : tuple of str
        Findings as sentences, such as limits of the model that are exceeded.
    """

    presenter: ClassVar[str] = "response"
    drive: Drive
    netlist: Netlist
    account: EnergyAccount
    stderr: Mapping[str, Array] = field(default_factory=dict)
    compared: tuple[Compared, ...] = ()
    checks: tuple[Difference, ...] = ()
    findings: tuple[Finding, ...] = ()
    curvatures: Curvatures | None = None
    wires: Wiring | None = None
    segments: Mapping[str, Array] = field(default_factory=dict)
    cells_error: float = 0.0
    tip: str = "free"
    load: Load | None = None

    def with_waveforms(self, **changed: Array) -> Response:
        """Return the response with some waveforms in place of its own."""
        return replace(self, waveforms={**self.waveforms, **changed})

    def shape(self, mechanics: str = "elastica", points: int = POINTS) -> Shape:
        """Return the strip's shape over time, at rest in each instant; `ilg_circuit.shape` has its inertia, too.

        Parameters
        ----------
        mechanics : {"elastica", "free"}
            Under weight and load, or as the strip would bend without these.
        points : int
            Least number of points along the strip.

        Returns
        -------
        Shape
            ``x``, ``y`` [m] and ``angle`` [rad], each (n, m), at ``time`` [s] (n,) and ``s`` [m] (m,).

        Raises
        ------
        InputError
            The strip has no coupling, or a value is out of range.
        SolveError
            No equilibrium is found.

        Examples
        --------
        >>> import ilg_circuit as ilg
        >>> shape = ilg.simulate("paper", "step:4V", "300 s", engine="exact").shape()
        >>> f"{1e3 * shape.tip[-1, 1]:.5f} mm"
        '3.95719 mm'
        """
        return static_shape(self, mechanics, points)

    @property
    def warnings(self) -> list[str]:
        """Gaps in the drive's file, and assumptions that fail in this run, with number and consequence."""
        displacement = float(np.nanmax(np.abs(self.displacement), initial=0.0))
        of_segments = (wave for name, wave in self.segments.items() if name.startswith("voltage_"))
        voltage = max(float(np.abs(wave).max()) for wave in (self.voltage, *of_segments))
        limited = limit_findings(self.drive, self.time, self.voltage)
        told = [*self.findings, *drive_findings(self.drive), *limited, *beyond_fit(self.actuator, voltage)]
        if self.cells_error > COARSE and self.curvatures is not None:
            values = {"count": len(self.curvatures.lengths), "error": self.cells_error}
            told.append(Finding("cells-coarse", values=values))
        found = sentences(told)
        return [*found, *run_warnings(self.actuator, self.drive, float(self.time[-1]), voltage, displacement)]

    def table(self) -> tuple[Column, ...]:
        """Return time and waveforms (n,), what is known of each segment, then the standard errors."""
        errors = (Column(f"{name}_stderr", error, WAVEFORMS[name].unit) for name, error in self.stderr.items())
        segments = (Column(name, values, _SEGMENT_UNITS[name.split("_")[0]]) for name, values in self.segments.items())
        return (*super().table(), *segments, *errors)

    def write_csv(self, path: str | Path, *, energy: bool = False) -> None:
        """Write the waveforms as CSV with full precision, blanks for NaN; `save` writes all of them.

        Parameters
        ----------
        path : str or Path
            The file to write; it is replaced whole or not at all.
        energy : bool
            Adds the energy as the last column.

        Raises
        ------
        InputError
            The file cannot be written.
        """
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
            **({"curvatures": self._curvatures()} if self.curvatures is not None else {}),
            "compared": [part.to_dict() for part in self.compared],
            "checks": [vars(difference) for difference in self.checks],
            "warnings": self.warnings,
        }

    def _curvatures(self) -> dict[str, Any]:
        assert self.curvatures is not None
        lengths, values = plain(self.curvatures.lengths), [plain(row) for row in self.curvatures.values]
        return {"lengths_m": lengths, "values_1_per_m": values, "cells_error": self.cells_error}


def sample_times(duration: float, *, samples: int | None = None, step: float | None = None) -> Array:
    """Return sample times from 0 to ``duration`` [s]: ``samples`` of them (default 601), or one every ``step`` [s].

    Raises InputError for values that give no sensible grid (2 to 2000000 samples).
    """
    if not (np.isfinite(duration) and duration > 0):
        raise InputError(f"duration {duration:g} s must be more than zero")
    require_plausible(argument("duration"), duration, "s")
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
    wires: Wiring | None = None,
) -> Response:
    """Return the strip's response to ``drive`` from rest, sampled at ``times`` [s] (ascending, >= 0).

    ``wires`` are those of the segments of a strip with electrodes, one source for each part of ``drive``.

    See `ilg_circuit.circuit.strip.strip_netlist` for ``tip``, ``beam`` and ``load``, and
    `ilg_circuit.solve.transient.transient` for ``engine``, ``accuracy`` (default 1e-9; 1e-6 with nonlinear elements)
    and the errors raised.
    """
    samples = sampled_times(drive, times)
    band = transient_band(samples)
    line, cells_error = line_of(actuator, band, wires, drive.largest())
    netlist = strip_netlist(actuator, tip=tip, beam=beam, load=load, band=band, by_current=by_current(drive), **line)
    acceptable = ACCEPTABLE if accuracy is None else accuracy
    if accuracy is None:
        accuracy = SIMULATION_ACCURACY if netlist.linear else NONLINEAR_ACCURACY
    probed = replace(netlist, outputs=netlist.outputs + probes(netlist) + curvature_probe(actuator, band))
    waveforms = transient(
        probed,
        drive,
        samples,
        engine=engine,
        accuracy=accuracy,
        acceptable=acceptable,
        interpolate=len(samples) > _MANY_SAMPLES,
        works=works(netlist),
        progress=progress,
    )
    solution = Solution(drive, samples, waveforms)
    values = {name: waveform.of(solution) for name, waveform in WAVEFORMS.items()}
    if line:
        error = _ladder_error_of_lumps(actuator, drive, samples)
    else:
        error = ladder_error(actuator, drive, samples, values, band)
    bent = cell_curvatures(line["layout"], solution) if line else curvatures(actuator, samples, waveforms)
    segments = {o.name: waveforms.output(o.name) for o in netlist.outputs if o.name.rstrip("0123456789") in _SEGMENTS}
    if line and bent is not None:
        segments |= {name: bent.values @ weights for name, weights in along_segments(line["layout"]).items()}
    return Response(
        actuator=actuator,
        drive=drive,
        netlist=netlist,
        time=samples,
        waveforms=values,
        account=account(netlist, waveforms),
        error=float(waveforms.errors.max()) + error + cells_error,
        engine=waveforms.engine,
        wires=wires,
        segments=segments,
        curvatures=bent,
        cells_error=cells_error,
        tip=tip,
        load=load,
    )


def _ladder_error_of_lumps(actuator: Actuator, drive: Drive, times: Array) -> float:
    """Return the error of a line's ladders: that of the lumped strip under each of the drives, 0 without ladders."""
    lump, coupling = replace(actuator, electrodes=None), actuator.coupling
    bending = coupling.ladder() if isinstance(coupling, RelaxingCoupling) else None
    if bending is None and not isinstance(actuator.material.model.ions, LadderPath):
        return 0.0
    runs = [simulate(lump, part, times, beam="static", engine="exact") for part in each(drive) if part.largest()]
    return max((run.error for run in runs), default=0.0)


def line_of(
    actuator: Actuator, band: tuple[float, float], wires: Wiring | None, voltage: float = 0.0
) -> tuple[dict[str, Any], float]:
    """Return the arguments of a line for `strip_netlist`, none for one lump, and the error of its cells.

    Raises InputError for ``wires`` without electrodes.
    """
    if actuator.electrodes is None:
        if wires is not None:
            raise InputError(
                f"actuator '{actuator.name}' has no [electrodes], so no segments: give it one drive, such as step:4V"
            )
        return {}, 0.0
    layout, error = chosen_layout(actuator, band, wires, voltage)
    return {"wires": wires, "layout": layout}, error


def transient_band(times: Array) -> tuple[float, float]:
    """Return the band [Hz] of the ladders of a run that is sampled at ``times`` [s]: it follows from their last alone.

    From a tenth of the frequency that the whole run resolves to `_RESOLVED` times it; no samples change the circuit.
    """
    if not len(times) or not times[-1]:
        return LADDER_BAND
    lowest = 0.1 / float(times[-1])
    return lowest, _RESOLVED * lowest


def limit_findings(drive: Drive, time: Array, voltage: Array) -> list[Finding]:
    """Return a finding where a source of current is at its limit at any of the samples."""
    limit = voltage_limit(drive)
    held = np.abs(voltage) >= (limit or np.inf) * (1 - 1e-9)
    if limit is None or not held.any():
        return []
    return [Finding("current-limited", values={"limit": limit, "first": float(time[held.argmax()])})]


def beyond_fit(actuator: Actuator, voltage: float) -> list[Finding]:
    """Return a finding where ``voltage`` [V] is larger than any that the strip was fitted at."""
    fitted = actuator.uncertainty.voltage if actuator.uncertainty is not None else None
    if fitted is None or voltage <= _BEYOND * fitted:
        return []
    return [Finding("beyond-fitted-voltage", values={"voltage": voltage, "fitted": fitted})]
