"""The frequency response of a strip."""

from __future__ import annotations

from numpy.typing import ArrayLike

from ..arrays import row
from ..circuit.load import Hung, load_of
from ..errors import checked
from ..simulation.bode import Bode
from ..simulation.bode import bode as solve
from ..simulation.impedance import frequencies
from .given import Given, Strip, quantity
from .given import load as strip_of


@checked
def bode(
    strip: Strip,
    low: Given = 1e-3,
    high: Given = 10.0,
    *,
    points: int | None = None,
    frequency: ArrayLike | None = None,
    bias: Given = 0.0,
    beam: str | None = None,
    load: Hung = None,
    engine: str = "exact",
    band: bool = False,
) -> Bode:
    """Return how displacement, current and blocked force of a strip follow the frequency of a small voltage.

    Parameters
    ----------
    strip : Actuator, str or Path
        An object, the path of a TOML file or a preset's name; it has a coupling.
    low : float or str
        Lowest frequency [Hz].
    high : float or str
        Highest frequency [Hz].
    points : int, optional
        Number of frequencies, evenly spaced in logarithm (default: ten per decade).
    frequency : array_like, optional
        The frequencies themselves [Hz] (f,), ascending, in place of a band.
    bias : float or str
        Constant voltage [V] to which the small signal is added.
    beam : {"dynamic", "static"}, optional
        Beam with or without its mass (default: as the coupling was fitted).
    load : Load, str or mapping, optional
        Load on the tip, such as "mass=1g"; the force is that on a clamp, without it.
    engine : {"exact", "ngspice"}
        Solver: the circuit's equations solved directly, or ngspice.
    band : bool
        Adds ``stderr``, standard errors of magnitude and phase from the covariance of a fitted strip.

    Returns
    -------
    Bode
        ``displacement`` [m/V], ``current`` [A/V] and ``force`` [N/V], complex (f,), over ``frequency`` [Hz] (f,), and
        the ``bandwidth`` [Hz]. See `ilg.results`.

    Raises
    ------
    InputError
        A value is not understood or out of range, or the strip has no coupling.
    SolveError
        The circuit cannot be solved.

    Examples
    --------
    >>> import ilg_circuit as ilg
    >>> response = ilg.bode("paper", "1 mHz", "1 Hz", beam="static")
    >>> round(1e3 * response.bandwidth, 1)
    13.9
    """
    actuator = strip_of(strip)
    ends = quantity(low, "Hz", "low"), quantity(high, "Hz", "high")
    chosen = frequencies(*ends, points) if frequency is None else row(frequency, "frequency")
    level, hung = quantity(bias, "V", "bias"), load_of(load)
    return solve(actuator, chosen, bias=level, beam=beam, load=hung, engine=engine, band=band)
