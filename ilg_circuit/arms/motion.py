"""Motions of an arm: positions, velocities, pressures, forces and energies over time; netCDF files of them."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array, plain
from ..errors import InputError
from ..extras import require_dataframe
from ..findings import Finding
from ..provenance import Provenance
from ..result import Column, Result
from .activation import CHANNELS, Activation
from .energy import evaluate
from .explicit import Integration
from .forces import ENERGIES, POWERS
from .lattice import Arm, Fluid, Muscle, Plane, cell_areas, model

if TYPE_CHECKING:
    from xarray import Dataset

#: Name of an array -> dimensions, unit and meaning, in a file.
VARIABLES = {
    "positions": (("rod", "side", "axis"), "m", "positions of the nodes"),
    "velocities": (("rod", "side", "axis"), "m/s", "velocities of the nodes"),
    "activations": (("segment", "channel"), "1", "eigenstrain (beam) or activation (yekutieli)"),
    "pressures": (("segment",), "Pa", "pressure that holds each cell's area"),
    "edge_forces": (("segment", "side"), "N", "tension of the springs along the faces, damping included"),
    "rod_forces": (("rod",), "N", "tension of the springs across the arm, damping included"),
    "energies": (("energy",), "J", "energy stored"),
    "works": (("work",), "J", "work of the actuators, and what was dissipated, since t = 0"),
}
#: Signals of a rhythm that drove the segments; as in `VARIABLES`.
SIGNALS = {
    "outputs": (("segment",), "1", "output of the network's unit that drives the segment"),
    "voltages": (("segment",), "V", "voltage of the segment's strip"),
    "charges": (("segment",), "C", "charge on the ion path of the segment's strip"),
}
_LABELS = {"side": ("+normal", "-normal"), "axis": ("x", "y"), "channel": CHANNELS, "energy": ENERGIES, "work": POWERS}


#: Mark of a warning in the attribute ``events`` of a file.
_WARNING = "warning: "


@dataclass(frozen=True)
class Event:
    """A finding at ``time`` [s], which may be a ``warning``."""

    time: float
    finding: Finding
    warning: bool = False

    @property
    def text(self) -> str:
        """The finding as a sentence, marked if it is a warning."""
        return f"{_WARNING if self.warning else ''}{self.finding}"


@dataclass(frozen=True, repr=False, eq=False)
class Motion(Result):
    """The motion of an arm over time; arrays have the shapes in `VARIABLES`, time first, in SI units.

    Attributes
    ----------
    time : ndarray (t,)
        Times [s].
    tip : ndarray (t, 2)
        Position of the tip [m].
    centreline : ndarray (t, n + 1, 2)
        Middle of each of the n + 1 rods [m].
    positions, velocities : ndarray (t, n + 1, 2, 2)
        Positions [m] and velocities [m/s] of the nodes: rod, side, axis.
    activations, pressures : ndarray
        Activations of the muscles and pressures in the segments [Pa].
    edge_forces, rod_forces : ndarray
        Tension along the faces and across the arm [N], damping included.
    energies : ndarray (t, 4)
        Kinetic, elastic, shear and gravitational energy [J].
    works : ndarray (t, 4)
        Work done by the actuators since t = 0, and energy lost to damping, drag and impact [J].
    signals : dict of str to ndarray (t, n)
        Signals of the rhythm that drove the arm, named as in `SIGNALS`; empty without one.
    arm : Arm
        The arm.
    method : str
        Integrator.
    text : str
        Description of the drive.
    events : tuple of Event
        Findings with the time at which they arose.
    """

    presenter: ClassVar[str] = "motion"

    arm: Arm
    time: Array
    positions: Array
    velocities: Array
    activations: Array
    pressures: Array
    edge_forces: Array
    rod_forces: Array
    energies: Array
    works: Array
    method: str
    text: str
    events: tuple[Event, ...] = ()
    signals: dict[str, Array] = field(default_factory=dict)

    @property
    def centreline(self) -> Array:
        """Middle of each rod [m] (t, n + 1, 2)."""
        return np.asarray(self.positions.mean(axis=2))

    @property
    def tip(self) -> Array:
        """Path of the tip [m] (t, 2)."""
        return self.centreline[:, -1]

    @property
    def first_segment_force(self) -> Array:
        """Internal force of the first segment [N] (t, 2): the tensions of its two edges, side +normal first."""
        return self.edge_forces[:, 0]

    @property
    def area_drift(self) -> float:
        """Largest change of a cell's area relative to that at the start."""
        areas = cell_areas(self.positions)
        return float(np.abs(areas / cell_areas(self.arm.rest_positions()) - 1).max())

    @property
    def energy_balance(self) -> Array:
        """Stored energy less its start, less the actuators' work, plus losses [J] (t,): zero for an exact solution."""
        stored = self.energies.sum(axis=1)
        return np.asarray(stored - stored[0] - self.works[:, 0] + self.works[:, 1:].sum(axis=1))

    @property
    def balance_error(self) -> float:
        """Largest `energy_balance` over the largest of all its terms (energies counted from their start)."""
        terms = np.concatenate([self.energies - self.energies[0], self.works], axis=1)
        largest = float(np.abs(terms).max())
        return float(np.abs(self.energy_balance).max()) / largest if largest else 0.0

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Findings of the events that are warnings."""
        return tuple(e.finding for e in self.events if e.warning)

    @property
    def warnings(self) -> tuple[str, ...]:
        """The events that are warnings, as sentences with their times."""
        return tuple(f"{e.finding} (at {e.time:.4g} s)" for e in self.events if e.warning)

    def snapshots(self, times: ArrayLike) -> tuple[Array, Array]:
        """Return the positions at the samples nearest to some times.

        Parameters
        ----------
        times : array_like
            Times [s]; those outside the run are left out.

        Returns
        -------
        times : ndarray (k,)
            Times of the samples [s].
        positions : ndarray (k, n + 1, 2, 2)
            Positions of the nodes [m]: rod, side, axis.
        """
        wanted = np.atleast_1d(np.asarray(times, dtype=np.float64))
        inside = wanted[(wanted >= self.time[0] - 1e-9) & (wanted <= self.time[-1] * (1 + 1e-9))]
        nearest = np.abs(self.time - inside[:, None]).argmin(axis=1)
        return self.time[nearest], self.positions[nearest]

    def table(self) -> tuple[Column, ...]:
        """Return time, the tip's place, the tensions in the first segment, energies and works (t,)."""
        pairs = [("tip_x", self.tip[:, 0], "m"), ("tip_y", self.tip[:, 1], "m")]
        sides = zip(("plus", "minus"), self.first_segment_force.T, strict=True)
        pairs += [(f"tension_{side}", force, "N") for side, force in sides]
        pairs += [(name, values, "J") for name, values in zip(ENERGIES, self.energies.T, strict=True)]
        pairs += [(name, values, "J") for name, values in zip(POWERS, self.works.T, strict=True)]
        return (Column("time", self.time, "s", over=True), *(Column(*column) for column in pairs))

    def to_dict(self) -> dict[str, Any]:
        """Return arm, method, accuracy and the table as plain data; positions of all nodes are in `to_xarray`."""
        return {
            "arm": asdict(self.arm),
            "method": self.method,
            "activation": self.text,
            "area_drift": self.area_drift,
            "balance_error": self.balance_error,
            "waveforms": {header: plain(values) for header, values in self.columns().items()},
            "events": [[e.time, e.text] for e in self.events],
            "warnings": list(self.warnings),
        }

    def to_xarray(self) -> Dataset:
        """Return all of the motion as an xarray Dataset with units, labels, arm and provenance."""
        require_dataframe("xarray")
        import xarray

        values = {name: getattr(self, name) for name in VARIABLES} | self.signals
        data = {
            name: (("time", *dimensions), values[name], {"units": unit, "long_name": meaning})
            for name, (dimensions, unit, meaning) in (VARIABLES | SIGNALS).items()
            if name in values
        }
        labels: dict[str, Any] = {name: list(texts) for name, texts in _LABELS.items()}
        labels["time"] = ("time", self.time, {"units": "s"})
        attributes = {
            "arm": json.dumps(asdict(self.arm)),
            "method": self.method,
            "activation": self.text,
            "events": json.dumps([[e.time, e.text] for e in self.events]),
            "findings": json.dumps([e.finding.to_dict() for e in self.events]),
            "provenance": json.dumps(self.provenance.to_dict()),
        }
        return xarray.Dataset(data, coords=labels, attrs=attributes)


def read_motion(path: str | Path) -> Motion:
    """Read a file that `Motion.save` of any version wrote. Raises InputError where it is not a motion."""
    import xarray

    try:
        with xarray.open_dataset(Path(path), engine="h5netcdf") as file:
            data = file.load()
        names = ("time", *VARIABLES, *(name for name in SIGNALS if name in data))
        arrays = {name: np.asarray(data[name].values, dtype=np.float64) for name in names}
        return Motion(
            arm=_arm(json.loads(data.attrs["arm"])),
            method=str(data.attrs["method"]),
            text=str(data.attrs["activation"]),
            events=_events(data.attrs),
            signals={name: arrays.pop(name) for name in SIGNALS if name in arrays},
            provenance=Provenance(**json.loads(data.attrs.get("provenance", '{"version": "0.1.0"}'))),
            **arrays,
        )
    except FileNotFoundError:
        raise InputError(f"cannot read '{path}': there is no such file") from None
    except (OSError, KeyError, TypeError, ValueError) as error:
        raise InputError(f"cannot read '{path}' as a motion: {' '.join(str(error).split())[:120]}") from None


def motion(arm: Arm, drive: Activation, samples: Array, run: Integration, method: str, events: list[Event]) -> Motion:
    """Return the `Motion` of a finished ``run``: forces and energies are evaluated here."""
    n, count = arm.segments, len(samples)
    values = drive.at(samples)
    energy, tension = np.empty((count, 4)), np.empty((count, 3 * n + 1))
    evaluate(model(arm), run.samples, values, energy, tension)
    positions, velocities = run.samples.reshape(count, 2, n + 1, 2, 2).swapaxes(0, 1)
    return Motion(
        arm=arm,
        time=samples,
        positions=positions,
        velocities=velocities,
        activations=values,
        pressures=run.pressures / arm.tapered(at_cells=True)[1],
        edge_forces=tension[:, : 2 * n].reshape(count, n, 2),
        rod_forces=tension[:, 2 * n :],
        energies=energy,
        works=run.works,
        method=method,
        text=drive.text,
        events=tuple(sorted(events, key=lambda e: e.time)),
    )


def _events(attributes: Mapping[str, Any]) -> tuple[Event, ...]:
    """Return the events of a file; those of version 0.1.0 have no findings but their texts."""
    events = [(float(time), str(text)) for time, text in json.loads(attributes["events"])]
    texts = [{"code": "arm-recorded", "values": {"text": text.removeprefix(_WARNING)}} for _, text in events]
    found = json.loads(attributes["findings"]) if "findings" in attributes else texts
    return tuple(
        Event(time, Finding(item["code"], item.get("subject", ""), item["values"]), text.startswith(_WARNING))
        for (time, text), item in zip(events, found, strict=True)
    )


def _arm(record: dict[str, Any]) -> Arm:
    """Return the arm from its dictionary."""
    values = {item.name: record[item.name] for item in fields(Arm)}
    for name, kind in {"muscle": Muscle, "fluid": Fluid, "plane": Plane}.items():
        if values[name] is not None:
            values[name] = kind(**values[name])
    if isinstance(values["curvature"], list):
        values["curvature"] = tuple(values["curvature"])
    return Arm(**values)
