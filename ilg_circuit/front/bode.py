"""The frequency response of a strip, from a model and from records."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import row
from ..circuit.load import Hung, load_of
from ..errors import InputError, checked
from ..identification.frequency_response import BodeOfRecords, bode_of_records, compared
from ..measurements.record import Record
from ..measurements.said import said_of
from ..measurements.waves import read_waves
from ..simulation.bode import Bode
from ..simulation.bode import bode as solve
from ..simulation.impedance import frequencies
from .data import Source, columns_of
from .given import Given, Strip, optional, quantity
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


@checked
def bode_of(
    records: Source | Sequence[Source],
    strip: Strip | None = None,
    low: Given | None = None,
    high: Given | None = None,
    *,
    skip: Given | None = None,
    bias: Given | None = None,
    beam: str | None = None,
    load: Hung = None,
    engine: str = "exact",
    columns: Mapping[str, str] | Iterable[str] = (),
    units: Mapping[str, str] | Iterable[str] = (),
    part: int | None = None,
    cycle: int | None = None,
) -> BodeOfRecords:
    """Return the frequency response that records show of a strip, with 95 % bands, and beside it that of a model.

    Parameters
    ----------
    records : str, Path, DataFrame, mapping, Record, or list of these
        Records of a sine, of sines one after another or together, of a chirp or of noise: paths, or columns such as
        time_s, voltage_V, displacement_mm, current_mA, force_mN. Several are taken together.
    strip : Actuator, str or Path, optional
        A strip to compare with.
    low : float or str, optional
        Lowest frequency [Hz] (default: the lowest that is excited).
    high : float or str, optional
        Highest frequency [Hz], likewise.
    skip : float or str, optional
        Time [s] at the beginning of sines that is left out (default: periods that differ from the later ones by more
        than their scatter).
    bias : float or str, optional
        Constant voltage [V] under the model's small signal (default: the middle of the records' voltage).
    beam : {"dynamic", "static"}, optional
        Beam of the model, see `bode`.
    load : Load, str or mapping, optional
        Load on the model's tip, see `bode`.
    engine : {"exact", "ngspice"}
        Solver of the model.
    columns : mapping of str to str, optional
        Titles of columns by quantity, if headers are not understood; as in `read`.
    units : mapping of str to str, optional
        Units by quantity, likewise.
    part : int, optional
        Which of several measurements in a file, see `read`.
    cycle : int, optional
        Which cycle of a file, see `read`.

    Returns
    -------
    BodeOfRecords
        ``responses`` by quantity, complex (f,), over ``frequency`` [Hz] (f,), with their ``variance`` and
        ``coherence``; ``band`` and ``outside`` of a quantity. See `ilg.results`.

    Raises
    ------
    InputError
        A record cannot be read, has no excitation or no displacement, or is too short for its lowest frequency.
    SolveError
        The model's circuit cannot be solved.

    Examples
    --------
    >>> import ilg_circuit as ilg
    >>> run = ilg.simulate("paper", "sine:1V,50mHz", "200 s", step="0.2 s", engine="exact")
    >>> record = {"time_s": run.time, "voltage_V": run.voltage, "displacement_m": run.displacement}
    >>> found = ilg.bode_of(record, "paper")
    >>> f"{found.frequency[0]:.3f} Hz: {1e6 * found.magnitude('displacement')[0]:.0f} um/V"
    '0.050 Hz: 106 um/V'
    """
    several = list(records) if isinstance(records, list | tuple) else [records]
    if not several:
        raise InputError("no record was given; give paths, data frames, or what ilg.read returned")
    said = said_of(columns, units, part, cycle)
    names = [f"record {k + 1}" if len(several) > 1 else "record" for k in range(len(several))]
    waves = [
        read_waves(each if isinstance(each, str | Path | Record) else columns_of(each), name, said)
        for each, name in zip(several, names, strict=True)
    ]
    ends = optional(low, "Hz", "low"), optional(high, "Hz", "high")
    found = bode_of_records(waves, *ends, optional(skip, "s", "skip"))
    level, hung = optional(bias, "V", "bias"), load_of(load)
    if strip is None:
        return found
    actuator = strip_of(strip)
    how: dict[str, Any] = {"bias": found.bias if level is None else level, "beam": beam, "load": hung, "engine": engine}
    distinct, places = np.unique(found.frequency, return_inverse=True)
    model = solve(actuator, distinct, **how).at(places)
    first, last = float(distinct[0]), float(distinct[-1])
    spread = 1.0 if len(distinct) > 1 else 3.0  # a curve about a single frequency
    curve = solve(actuator, frequencies(first / spread, last * spread, 100), **how)
    return compared(found, model, curve)
