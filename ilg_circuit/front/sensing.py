"""The law by which a strip senses, from records of a moved tip."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from ..errors import InputError, argument, checked, wrong_choice
from ..identification.sensing import SensingFit
from ..identification.sensing import identify_sensing as fit_sensing
from ..measurements.record import Record
from ..measurements.said import said_of
from ..measurements.waves import read_sensed
from .data import Source, columns_of
from .given import Strip
from .given import load as strip_of


@checked
def identify_sensing(
    records: Source | Sequence[Source],
    strip: Strip,
    *,
    terminals: str | None = None,
    columns: Mapping[str, str] | Iterable[str] = (),
    units: Mapping[str, str] | Iterable[str] = (),
    part: int | None = None,
    cycle: int | None = None,
) -> SensingFit:
    """Return the law by which a strip senses, fitted to records of its moved tip: motion in, voltage or current out.

    Parameters
    ----------
    records : str, Path, DataFrame, mapping, Record, or list of these
        Records of a strip at rest whose tip is then moved: paths, or columns such as time_s, displacement_mm and
        voltage_mV (open terminals) or current_uA (shorted ones).
    strip : Actuator, str or Path
        The strip with its circuit, such as a fitted one: an object, the path of a TOML file or a preset's name.
    terminals : {"open", "short"}, optional
        Which signal to take of records that have both (default: the one that they have).
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
    SensingFit
        ``actuator`` has the law as its ``sensing``, which `sense` then uses in place of reciprocity; ``ratio`` is the
        measured signal over the reciprocal one. See `ilg.results`.

    Raises
    ------
    InputError
        A record has no motion or no signal, or the strip's circuit is nonlinear.
    SolveError
        No law can be fitted.

    Notes
    -----
    The law is a gain per strain of the strip's face and up to two relaxations, as many as BIC asks for:
    sensing_instantaneous, sensing_gain_1 [V] and sensing_time_1 [s]. The motion's own noise is not accounted for.

    Examples
    --------
    >>> import numpy as np
    >>> import ilg_circuit as ilg
    >>> t = np.linspace(0, 40, 401)
    >>> y = 1e-3 * np.sin(t) * (1 - np.exp(-t))
    >>> signal = 2.0 * y + 1e-6 * np.sin(1e3 * t)
    >>> fit = ilg.identify_sensing({"time_s": t, "displacement_m": y, "current_A": -signal}, "paper")
    >>> f"{fit.ratio:.0e}"
    '2e+09'
    """
    if terminals not in (None, "open", "short"):
        raise wrong_choice(argument("terminals"), str(terminals), ("open", "short"))
    several = list(records) if isinstance(records, list | tuple) else [records]
    if not several:
        raise InputError("no record was given; give paths, data frames, or what ilg.read returned")
    said = said_of(columns, units, part, cycle)
    names = [f"record {k + 1}" if len(several) > 1 else "record" for k in range(len(several))]
    sensed = [
        read_sensed(each if isinstance(each, str | Path | Record) else columns_of(each), name, terminals, said)
        for each, name in zip(several, names, strict=True)
    ]
    return fit_sensing(sensed, strip_of(strip))
