"""Trade-offs between outputs of strips."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from ..errors import checked
from ..study.design import DesignReport, design
from ..study.plan import Vary
from .given import Driven, Given, Strip, drive_of, quantity
from .given import load as strip_of


@checked
def pareto(
    strip: Strip,
    drive: Driven,
    duration: Given,
    vary: Vary,
    objectives: str | Iterable[str],
    *,
    points: int | None = None,
    require: str | Iterable[str] = (),
    **options: Any,
) -> DesignReport:
    """Return the trade-off between two or three objectives: strips of which none is better in all of them.

    Parameters
    ----------
    strip : Actuator, str or Path
        Strip that is varied: an object, the path of a TOML file or a preset's name.
    drive : str, Drive or (times, values)
        A text such as "step:4V", whose values can be varied too, or a drive.
    duration : float or str
        Duration of the run [s].
    vary : mapping or iterable of str
        Ranges, as in `design`.
    objectives : str or iterable of str
        Two or three outputs, such as ``["displacement_final", "force_blocked", "min:energy"]``. The names are listed
        in `sweep`. Displacements and forces are maximised, others minimised; min: or max: before a name says which.
    points : int, optional
        Number of points of the front (default: 25 for two objectives, 60 for three).
    require : str or iterable of str
        Requirements that all designs meet, as in `design`.
    **options : Any
        ``tip``, ``beam``, ``load``, ``engine``, ``seed``, ``sobol``, ``progress`` of `design`.

    Returns
    -------
    DesignReport
        ``report.front`` holds the designs: ``parameters`` and ``simulated`` map names to arrays (k,) in SI units.
        ``report.to_dataframe()`` has one row a design. See `ilg.results`.

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
    seconds = quantity(duration, "s", "duration")
    source = drive if isinstance(drive, str) else drive_of(drive, seconds)
    return design(strip_of(strip), source, seconds, vary, require=require, pareto=objectives, points=points, **options)
