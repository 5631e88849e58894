"""The shape of a strip over time, by one of three levels of mechanics."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..errors import InputError, checked
from ..extras import require_arm
from ..simulation.response import Response
from ..simulation.shape import POINTS, static_shape

if TYPE_CHECKING:
    from ..simulation.shape import Shape


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
