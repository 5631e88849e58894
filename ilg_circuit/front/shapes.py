"""The shape of a strip over time, by one of three levels of mechanics; the resistance along it from its shape."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array, row
from ..errors import InputError, argument, checked
from ..extras import require_arm
from ..identification.shape import ShapeFit
from ..identification.shape import identify_shape as fit_shape
from ..measurements.marks import Marks, read_marks
from ..measurements.said import Said, said_of
from ..simulation.response import Response
from ..simulation.shape import POINTS, static_shape
from ..units import si
from .given import Given, Strip, load, optional

if TYPE_CHECKING:
    from ..simulation.shape import Shape

#: Tracks of marks: files, or times [s] (n,) with x and y [m] (n, marks).
Tracks: TypeAlias = str | Path | Sequence[str | Path] | tuple[ArrayLike, ArrayLike, ArrayLike]


@checked
def shape(run: Response, mechanics: str = "elastica", *, points: int = POINTS) -> Shape:
    """Return the shape of a strip over the time of a run: its centre line, exact for large deflections.

    Parameters
    ----------
    run : Response
        Response of the strip, from `simulate`.
    mechanics : {"elastica", "free", "arm"}
        "elastica": at rest in each instant under its weight and load; "free": as its free curvature bends it, without
        these; "arm": with its inertia, damping, weight and load.
    points : int
        Least number of points along the strip.

    Returns
    -------
    Shape
        ``x``, ``y`` [m] and ``angle`` [rad], each (n, m), at ``time`` [s] (n,) and distances ``s`` [m] (m,) from the
        clamp; ``tip`` (n, 2). See `ilg.results`.

    Raises
    ------
    InputError
        The strip has no coupling, or a value is out of range.
    SolveError
        No equilibrium is found, or the motion cannot be computed.

    Examples
    --------
    >>> import ilg_circuit as ilg
    >>> run = ilg.simulate("paper", "step:4V", "300 s", engine="exact")
    >>> shape = ilg.shape(run)
    >>> [f"{1e3 * place:.5f} mm" for place in shape.tip[-1]]
    ['29.64914 mm', '3.95719 mm']
    """
    if not isinstance(run, Response):
        raise InputError(f"the shape is that of a run, such as ilg.simulate(...), not of {type(run).__name__}")
    if mechanics == "arm":
        require_arm()
        from ..arms.chain_motion import moving_shape

        return moving_shape(run, points)
    return static_shape(run, mechanics, points)


@checked
def identify_shape(
    marks: Tracks,
    strip: Strip,
    *,
    frequency: Given | None = None,
    places: str | Sequence[Given] | None = None,
    port: bool = True,
    scale: Given | None = None,
    columns: Mapping[str, str] | Iterable[str] = (),
    units: Mapping[str, str] | Iterable[str] = (),
) -> ShapeFit:
    """Return the resistance along a strip's electrodes, from the shape that marks on it show.

    Parameters
    ----------
    marks : str, Path, list of these, or (times, x, y)
        Tracks of marks: a file with time_s, x_mm, y_mm for each mark; or one with x1_mm, y1_mm, x2_mm, y2_mm, ...; or
        times [s] (n,) and positions [m] (n, m). x is the direction of the strip at the clamp, which is the origin; the
        readings until t = 0, or the first one, show the strip straight.
    strip : Actuator, str or Path
        The strip: an object, the path of a TOML file or a preset's name.
    frequency : float or str, optional
        Frequency [Hz] of a sine that drives the strip (default: a constant voltage under which it has come to rest; the
        last tenth of the record is averaged).
    places : str or list, optional
        Distances of the marks from the clamp [m], such as "10mm,20mm,30mm" (default: each x at rest).
    port : bool
        True: the sheets' resistance, with the admittance of the strip's port; False: (gamma L)^2 alone, which needs no
        port.
    scale : float or str, optional
        Size of a camera's pixel [m], if a file has pixels.
    columns : mapping of str to str, optional
        Titles of columns by quantity, if headers are not understood; as in `read`.
    units : mapping of str to str, optional
        Units by quantity, likewise.

    Returns
    -------
    ShapeFit
        ``fit["sheet_resistance"]`` [ohm], per square and of both sheets added; ``fit.gamma_length``. See `ilg.results`.

    Raises
    ------
    InputError
        The marks cannot be read or do not lie on the strip.
    SolveError
        The marks do not determine the parameters.

    Notes
    -----
    A shape fixes the product of the sheets' resistance r and the admittance y of a length of strip, as
    (gamma L)^2 = r y L^2. The resistance alone follows from a known y: fit the strip's port first.

    Examples
    --------
    >>> import numpy as np
    >>> import ilg_circuit as ilg
    >>> s = np.array([0.01, 0.02, 0.03])
    >>> y = [0 * s, 1e-3 * np.array([0.5, 1.7, 3.3])]
    >>> fit = ilg.identify_shape(([0.0, 300.0], [s, s], y), "paper", port=False)
    >>> fit["gamma_length_squared"].value > 0
    True
    """
    said = said_of(columns, units, None, None)
    tracks = _tracks(marks, said if scale is None else replace(said, scale=si(scale, "m", argument("scale"))))
    at = None if places is None else _places(places)
    return fit_shape(tracks, load(strip), frequency=optional(frequency, "Hz", "frequency"), places=at, port=port)


def _tracks(marks: Tracks, said: Said) -> Marks:
    if isinstance(marks, str | Path):
        return read_marks([marks], said)
    if isinstance(marks, tuple) and len(marks) == 3 and not any(isinstance(part, str | Path) for part in marks):
        given: Any = marks
        time = row(given[0], "times of the marks")
        x, y = (np.atleast_2d(np.asarray(part, dtype=float)) for part in given[1:])
        if x.shape != y.shape or x.shape[0] != len(time):
            raise InputError(
                f"marks: x and y have the shapes {x.shape} and {y.shape}; give ({len(time)}, marks) of both"
            )
        return Marks("marks", (time,) * x.shape[1], tuple(x.T), tuple(y.T))
    paths: Any = marks
    return read_marks(list(paths), said)


def _places(given: str | Sequence[Given]) -> Array:
    cells = given.split(",") if isinstance(given, str) else given
    return np.array([si(cell, "m", argument("places")) for cell in cells])
