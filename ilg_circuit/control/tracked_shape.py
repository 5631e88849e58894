"""The voltages of a strip's segments whose shape is nearest to a path, as a result."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from ..arrays import Array, plain
from ..drive import Drives, PiecewiseLinear, levels
from ..files import write_csv
from ..findings import Finding, Warned
from ..result import Column, Result
from ..simulation.response import Response
from ..strip.actuator import Actuator
from .programme import Limits
from .track import FOLLOWED

#: Units of the targets, by their names without a segment's number.
UNITS = {"displacement": "m", "angle": "rad", "curvature": "1/m"}


@dataclass(frozen=True, repr=False, eq=False)
class TrackedShape(Warned, Result):
    """The voltages of a strip's segments whose shape is nearest to a path, as `ilg_circuit.track` returns them.

    A target is "curvature_1" [1/m], ..., the mean free curvature of a segment, "angle" [rad], that of the free end as
    these bend it, or "displacement" [m].

    Attributes
    ----------
    actuator : Actuator
        The strip.
    paths : mapping of str to ndarray (m,)
        What is asked for by target, at ``time``, which is that of the voltages' nodes and half way between them.
    drive : Drives or PiecewiseLinear
        The voltages as a drive for `ilg_circuit.simulate`; one for all segments if they are ``alike``.
    limits : tuple of Limits
        Largest ``voltage`` [V], ``slew`` [V/s], ``current`` [A] of each voltage; ``energy`` [J] is that of all.
    stderr : mapping of str to ndarray (m,)
        Standard errors of the targets from the uncertainty of a fitted strip; empty without a band.
    at_limit : tuple of float
        Share of the time at a limit, of each voltage.
    reach, rate : mapping of str to float
        Largest value of each target that the limits of the voltages hold, and largest rate that they reach from rest,
        of each by itself.
    at_rest : float
        Least largest error, in parts of ``sizes``, with which voltages within their limits hold the farthest shape of
        the path at rest.
    bound : float or None
        Shortest time [s] in which any voltages settle at this shape; None if it is out of reach.
    determined : bool
        Whether the targets determine all voltages; if not, they are those of least effort.
    response : Response
        The run of the strip under the drive.
    findings : tuple of Finding
        What the voltages should be known for.
    """

    presenter: ClassVar[str] = "track_shape"
    actuator: Actuator
    path_text: str
    paths: Mapping[str, Array]
    drive: Drives | PiecewiseLinear
    limits: tuple[Limits, ...]
    response: Response
    at_limit: tuple[float, ...]
    reach: Mapping[str, float]
    rate: Mapping[str, float]
    at_rest: float
    bound: float | None
    determined: bool
    stderr: Mapping[str, Array]
    findings: tuple[Finding, ...] = ()

    @property
    def time(self) -> Array:
        """Times [s] (m,)."""
        return self.response.time

    @property
    def alike(self) -> bool:
        """Whether one voltage drives all segments."""
        return isinstance(self.drive, PiecewiseLinear)

    @property
    def outputs(self) -> dict[str, Array]:
        """What follows the path (m,), by target."""
        return {name: output_of(self.response, name) for name in self.paths}

    @property
    def errors(self) -> dict[str, Array]:
        """Path less output (m,), by target."""
        return {name: np.asarray(self.paths[name] - output) for name, output in self.outputs.items()}

    @property
    def rms(self) -> dict[str, float]:
        """Root mean square of the error over time, by target."""
        span = float(self.time[-1] - self.time[0])
        return {name: float(np.sqrt(np.trapezoid(e**2, self.time) / span)) for name, e in self.errors.items()}

    @property
    def sizes(self) -> dict[str, float]:
        """What errors count against: the largest value of a target that the path asks for; curvatures share one.

        Of a path that stays zero it is the target's reach.
        """
        return sizes_of(self.paths, self.reach)

    @property
    def followed(self) -> bool:
        """Whether the error of each target stays within 1 % of its size."""
        sizes = self.sizes
        return all(float(np.abs(e).max()) <= FOLLOWED * sizes[name] for name, e in self.errors.items())

    @property
    def farthest(self) -> int:
        """The sample at which the path is farthest from the straight strip."""
        return farthest_of(self.paths, self.sizes)

    @property
    def voltages(self) -> dict[str, Array]:
        """Voltage of each segment [V] (m,), by its number; of segments that are alike by "all"."""
        return dict(zip(self.sources, levels(self.drive, self.time), strict=True))

    @property
    def currents(self) -> dict[str, Array]:
        """Current into each segment [A] (m,), likewise."""
        return dict(zip(self.sources, currents_of(self.response, len(self.sources)), strict=True))

    @property
    def sources(self) -> tuple[str, ...]:
        """Numbers of the segments that have a voltage; "all" where they are alike."""
        return tuple(name for name, _ in self.drive.named) if isinstance(self.drive, Drives) else ("all",)

    @property
    def energy(self) -> float:
        """Energy delivered by all sources [J]."""
        return float(self.response.energy[-1])

    def write_drive(self, path: str | Path) -> None:
        """Write the voltages as a CSV file that ``simulate --drive file:`` reads: voltage_1_V, voltage_2_V, ...

        Parameters
        ----------
        path : str or Path
            The file to write; it is replaced whole or not at all.

        Raises
        ------
        InputError
            The file cannot be written.
        """
        if isinstance(self.drive, PiecewiseLinear):
            return write_csv(path, {"time_s": self.drive.times, "voltage_V": self.drive.values})
        times, values = _nodes(self.drive)
        write_csv(path, {"time_s": times} | {f"voltage_{k}_V": v for k, v in zip(self.sources, values, strict=True)})

    def table(self) -> tuple[Column, ...]:
        """Return time, path and output of each target, its standard error, voltage and current of segments (m,)."""
        columns = [Column("time", self.time, "s", over=True)]
        for name, output in self.outputs.items():
            columns += [Column(f"path_{name}", self.paths[name], unit_of(name)), Column(name, output, unit_of(name))]
            if name in self.stderr:
                columns.append(Column(f"{name}_stderr", self.stderr[name], unit_of(name)))
        for (k, volts), flowing in zip(self.voltages.items(), self.currents.values(), strict=True):
            end = "" if self.alike else f"_{k}"
            columns += [Column(f"voltage{end}", volts, "V"), Column(f"current{end}", flowing, "A")]
        return tuple(columns)

    def to_dict(self) -> dict[str, Any]:
        """Return the voltages, the errors and the limits as plain data; waveforms are lists by header."""
        sizes, rms = self.sizes, self.rms
        return {
            "actuator": self.actuator.name,
            "path": self.path_text,
            "quantity": "shape",
            "followed": self.followed,
            "determined": self.determined,
            "alike": self.alike,
            "at_rest": self.at_rest,
            "bound": self.bound,
            "energy": self.energy,
            "targets": {
                name: {
                    "unit": unit_of(name),
                    "path_largest": float(np.abs(self.paths[name]).max()),
                    "path_rate": path_rate(self, name),
                    "size": sizes[name],
                    "reach": self.reach[name],
                    "rate": self.rate[name],
                    "error_largest": float(np.abs(error).max()),
                    "error_rms": rms[name],
                }
                for name, error in self.errors.items()
            },
            "segments": {
                name: {"limits": vars(of), "at_limit": share}
                for name, of, share in zip(self.sources, self.limits, self.at_limit, strict=True)
            },
            "engine": self.response.engine,
            "waveforms": {column.header: plain(np.asarray(column.values)) for column in self.table()},
            "findings": [finding.to_dict() for finding in self.findings],
        }


def unit_of(target: str) -> str:
    """Return the unit of a target."""
    return UNITS[target.partition("_")[0]]


def path_rate(tracked: TrackedShape, target: str) -> float:
    """Return the largest rate of a target that the path asks for between samples."""
    return float(np.abs(np.diff(tracked.paths[target]) / np.diff(tracked.time)).max())


def sizes_of(paths: Mapping[str, Array], reach: Mapping[str, float]) -> dict[str, float]:
    """Return the sizes of targets, see `TrackedShape.sizes`."""
    found: dict[str, float] = {}
    for name in paths:
        alike = [other for other in paths if unit_of(other) == unit_of(name)]
        largest = max(float(np.abs(paths[other]).max()) for other in alike)
        found[name] = largest or max(reach[other] for other in alike) or 1.0
    return found


def farthest_of(paths: Mapping[str, Array], sizes: Mapping[str, float]) -> int:
    """Return the sample at which a path is farthest from the straight strip, see `TrackedShape.farthest`."""
    return int(np.sum([(path / sizes[name]) ** 2 for name, path in paths.items()], axis=0).argmax())


def output_of(response: Response, target: str) -> Array:
    """Return a target (n,) of a response."""
    return response.displacement if target == "displacement" else response.segments[target]


def currents_of(response: Response, count: int) -> Array:
    """Return the currents of the sources (N, m) [A]."""
    if count == 1:
        return response.current[None]
    return np.stack([response.segments[f"current_{k + 1}"] for k in range(count)])


def _nodes(drive: Drives) -> tuple[Array, list[Array]]:
    """Return the nodes [s] of voltages (n,), and their values [V], (n,) each."""
    parts = [part for part in drive.parts if isinstance(part, PiecewiseLinear)]
    return parts[0].times, [part.values for part in parts]
