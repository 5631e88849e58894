"""The shape of a strip over time: its centre line, exact for large deflections of curvatures constant in cells.

Axes: x along the strip at the clamp, which is the origin, and y towards the anode; the angle is that of the centre
line from x. ``free``: each cell is an arc. ``elastica``: at rest in each instant under weight and load, see `elastica`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from ..arrays import Array
from ..errors import InputError, argument, wrong_choice
from ..extras import require_dataframe
from ..findings import Finding, Warned
from ..result import Column, Result
from ..strip.elements import bending_stiffness
from .curvature import Curvatures
from .elastica import acting, elastica
from .mechanics import MECHANICS

if TYPE_CHECKING:
    from xarray import Dataset

    from .response import Response

#: Points along the strip.
POINTS = 41


@dataclass(frozen=True, repr=False, eq=False)
class Shape(Warned, Result):
    """The shape of a strip over time, as `ilg_circuit.shape` returns it.

    x is the direction of the strip at the clamp, which is the origin; y points towards the anode.

    Attributes
    ----------
    time : ndarray (n,)
        Times [s].
    s : ndarray (m,)
        Distance along the centre line from the clamp [m], ascending; the ends of cells are among them.
    x, y : ndarray (n, m)
        Centre line [m].
    angle : ndarray (n, m)
        Angle of the centre line from x [rad], positive towards y.
    tip : ndarray (n, 2)
        x and y of the free end [m].
    text : str
        Strip and drive.
    mechanics : str
        "free", "elastica" or "arm".
    warnings : tuple of str
        Findings as sentences.
    """

    presenter: ClassVar[str] = "shape"

    time: Array
    s: Array
    x: Array
    y: Array
    angle: Array
    text: str
    mechanics: str = "free"
    findings: tuple[Finding, ...] = ()

    @property
    def tip(self) -> Array:
        """Free end [m] (n, 2)."""
        return np.stack([self.x[:, -1], self.y[:, -1]], axis=1)

    def table(self) -> tuple[Column, ...]:
        """Return one row for each time and place: time, s, x, y and the angle theta (n m,)."""
        return (
            Column("time", np.repeat(self.time, len(self.s)), "s"),
            Column("s", np.tile(self.s, len(self.time)), "m"),
            Column("x", self.x.ravel(), "m"),
            Column("y", self.y.ravel(), "m"),
            Column("theta", self.angle.ravel(), "rad"),
        )

    def to_dict(self) -> dict[str, Any]:
        """Return times, places and, for each time, lists of x, y and angle as plain data."""
        return {
            "text": self.text,
            "mechanics": self.mechanics,
            "time_s": self.time.tolist(),
            "s_m": self.s.tolist(),
            "x_m": self.x.tolist(),
            "y_m": self.y.tolist(),
            "theta_rad": self.angle.tolist(),
            "warnings": list(self.warnings),
        }

    def to_xarray(self) -> Dataset:
        """Return x, y and theta over time and s as an xarray Dataset with units."""
        require_dataframe("xarray")
        import json

        from xarray import Dataset

        values = {"x": (self.x, "m"), "y": (self.y, "m"), "theta": (self.angle, "rad")}
        data = {name: (("time", "s"), array, {"units": unit}) for name, (array, unit) in values.items()}
        coordinates = {"time": ("time", self.time, {"units": "s"}), "s": ("s", self.s, {"units": "m"})}
        about = {"title": self.text, "mechanics": self.mechanics}
        return Dataset(data, coordinates, about | {"provenance": json.dumps(self.provenance.to_dict())})


def arcs(free: Curvatures, places: Array) -> tuple[Array, Array, Array]:
    """Return x, y [m] and the angle [rad], each (n, m), at ``places`` [m] (m,): an arc in each cell."""
    marks = np.union1d(free.ends, places)
    angle = free.angles(marks)
    half = np.diff(angle, axis=1) / 2
    chord = np.diff(marks) * _chord_over_arc(half)
    middle = angle[:, :-1] + half
    at = np.searchsorted(marks, places)
    x, y = (
        np.pad(np.cumsum(chord * part, axis=1), ((0, 0), (1, 0)))[:, at] for part in (np.cos(middle), np.sin(middle))
    )
    return x, y, angle[:, at]


def along(free: Curvatures, points: int, also: Array | None = None) -> Array:
    """Return at least ``points`` places [m] from clamp to free end: cells in equal parts, and those of ``also``."""
    if not 2 <= points <= 100_000:
        raise InputError(f"{argument('points')} is {points}; give 2 to 100000")
    ends = free.ends
    parts = np.maximum(np.ceil((points - 1) * free.lengths / ends[-1] - 1e-9), 1).astype(int)
    inner = [np.linspace(a, b, n, endpoint=False) for a, b, n in zip(ends[:-1], ends[1:], parts, strict=True)]
    places = np.concatenate([*inner, ends[-1:]])
    more = np.empty(0) if also is None else also[np.abs(also[:, None] - places).min(axis=1) > 1e-9 * ends[-1]]
    return np.sort(np.concatenate([places, more]))


def curved(response: Response) -> Curvatures:
    """Return the curvatures of a response. Raises InputError where it has none."""
    if response.curvatures is None:
        raise InputError(f"actuator '{response.actuator.name}' has no [coupling]; its shape is not known")
    return response.curvatures


def described(response: Response) -> str:
    """Return strip and drive, for the text of a shape."""
    return f"{response.actuator.name}, {response.drive.text}"


def static_shape(response: Response, mechanics: str = "elastica", points: int = POINTS) -> Shape:
    """Return the shape of a strip by arcs ("free") or at rest in each instant under weight and load ("elastica").

    Raises InputError for another word or a strip without a coupling, SolveError where no equilibrium is found.
    """
    if mechanics not in MECHANICS[:2]:
        raise wrong_choice("mechanics", mechanics, MECHANICS)
    free, actuator = curved(response), response.actuator
    places = along(free, points, np.array([actuator.geometry.load_distance]))
    on = acting(actuator, response.load, response.tip)
    bent = mechanics == "elastica" and on
    x, y, angle = elastica(free, bending_stiffness(actuator), on, places) if bent else arcs(free, places)
    findings = (Finding("shape-forces-left-out"),) if on and not bent else ()
    return Shape(response.time, places, x, y, angle, described(response), mechanics, findings)


def _chord_over_arc(half: Array) -> Array:
    """Return sin(a)/a of half the angle of an arc: its chord over its length."""
    small = np.abs(half) < 1e-2
    square = half**2
    series = 1 - square / 6 * (1 - square / 20 * (1 - square / 42))
    return np.asarray(np.where(small, series, np.sin(half) / np.where(small, 1.0, half)))
