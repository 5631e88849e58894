"""Many strips: sweeps, designs, trade-offs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from ..study.design import DesignReport
from ..study.design import design as find
from ..study.sweep import SweepResult
from ..study.sweep import sweep as solve
from .given import Driven, Given, Hung, Strip, load_of, quantity, ranges
from .given import drive_of as as_drive
from .given import load as strip_of


def sweep(
    strip: Strip,
    drive: Driven,
    duration: Given,
    vary: Mapping[str, Any] | Iterable[str] = (),
    *,
    load: Hung = None,
    **options: Any,
) -> SweepResult:
    """Return what many designs of a strip do: each value that is varied, and the outputs of its run.

    Parameters
    ----------
    strip, drive, duration, load
        As in `simulate`.
    vary
        ``{"thickness": ("0.2 mm", "1 mm", 9)}`` or texts such as "thickness=0.2mm:1mm:9": names with low, high and a
        number of points. Names are the keys of a strip's file, of the drive (voltage, period, ...) and of the load.
    options
        ``out`` (a netCDF file; without it the result is kept in memory), ``random``, ``method``, ``seed``,
        ``designs``, ``outputs``, ``waveforms``, ``samples``, ``engine``, ``accuracy``, ``tip``, ``beam``, ``jobs``,
        ``cluster``, ``executor``, ``progress`` of `study.sweep.sweep`.

    Raises
    ------
    InputError
        A name, a range or an option is not understood.
    SolveError
        Every design fails.

    Examples
    --------
    >>> import ilg_circuit as ilg
    >>> found = ilg.sweep("paper", "step:4V", "300 s", {"thickness": ("0.4 mm", "0.6 mm", 3)}, engine="exact", jobs=1)
    >>> found.to_xarray().displacement_final.shape
    (3,)
    """
    seconds = quantity(duration, "s", "duration")
    return solve(strip_of(strip), _kept(drive, seconds), seconds, vary=ranges(vary), load=load_of(load), **options)


def design(
    strip: Strip,
    drive: Driven,
    duration: Given,
    vary: Mapping[str, Any] | Iterable[str],
    *,
    require: str | Iterable[str] = (),
    minimise: str | None = None,
    maximise: str | None = None,
    load: Hung = None,
    **options: Any,
) -> DesignReport:
    """Return the strip, within the ranges of ``vary``, that meets requirements and is best.

    Parameters
    ----------
    strip, drive, duration, vary, load
        As in `sweep`; ranges are low and high.
    require
        Requirements such as "displacement_final>=4mm".
    minimise, maximise
        Name of an output; without one the worst margin of the requirements is maximised.
    options
        ``tip``, ``beam``, ``engine``, ``seed``, ``sensitivity``, ``confidence``, ``sobol``, ``pareto``, ``points``,
        ``progress`` of `study.design.design`.

    Raises
    ------
    InputError
        A name, a range or a requirement is not understood.
    SolveError
        No design can be simulated.

    Examples
    --------
    >>> import ilg_circuit as ilg
    >>> wanted = {"require": "displacement_final>=4mm", "minimise": "energy"}
    >>> report = ilg.design("paper", "step:4V", "300 s", {"thickness": ("0.2 mm", "1 mm")}, **wanted)
    >>> report.feasible
    True
    """
    seconds = quantity(duration, "s", "duration")
    return find(
        strip_of(strip),
        _kept(drive, seconds),
        seconds,
        vary=ranges(vary),
        require=[require] if isinstance(require, str) else require,
        minimise=minimise,
        maximise=maximise,
        load=load_of(load),
        **options,
    )


def pareto(
    strip: Strip,
    drive: Driven,
    duration: Given,
    vary: Mapping[str, Any] | Iterable[str],
    objectives: str | Iterable[str],
    *,
    points: int | None = None,
    require: str | Iterable[str] = (),
    **options: Any,
) -> DesignReport:
    """Return the trade-off of two or three objectives, in ``front`` of the report.

    Parameters
    ----------
    strip, drive, duration, vary, require, **options : Actuator, str or Path / str, Drive or (times, values) / float or str / mapping or iterable of str / str or iterable of str / Any
        As in `design`.
    objectives : str or iterable of str
        Outputs such as ``["displacement_final", "force_blocked"]``; each is maximised, or minimised after a minus sign.
    points : int, optional
        Number of points of the front.

    Returns
    -------
    DesignReport
        Its ``front`` holds the designs.

    Raises
    ------
    InputError
        A name, a range or an objective is not understood.
    SolveError
        No design meets the requirements.

    Examples
    --------
    >>> import ilg_circuit as ilg
    >>> ranges, aims = {"thickness": ("0.2 mm", "1 mm")}, ["displacement_final", "force_blocked"]
    >>> report = ilg.pareto("paper", "step:4V", "300 s", ranges, aims, points=3)
    >>> len(report.front.simulated["force_blocked"])
    3
    """
    names = objectives if isinstance(objectives, str) else ",".join(objectives)
    return design(strip, drive, duration, vary, require=require, pareto=names, points=points, **options)


def _kept(drive: Driven, duration: float) -> Any:
    """Return a text as it is, whose values can then be varied; other drives as objects."""
    return drive if isinstance(drive, str) else as_drive(drive, duration)
