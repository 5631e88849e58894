"""Parameters from measurements: of a strip, of a gel."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

from numpy.typing import ArrayLike

from ..errors import InputError
from ..hyperelastic import Characterisation, characterise
from ..identification.identification import Identification
from ..identification.identify import identify as fit
from ..measurements.load_test import LoadTest
from ..measurements.onset import Stated
from .data import Source, by_header, one_of, read, sets_of
from .given import Given, Strip, load, quantity


def identify(
    data: Source | Sequence[Source] | None = None,
    strip: Strip | None = None,
    *,
    model: str = "auto",
    onset: Stated | str = None,
    electrode_resistance: Given | Literal["fit"] | None = None,
    bias: Given | Sequence[Given] | None = None,
    until: Given | None = None,
    displacement_delay: Given | Literal["fit"] | None = None,
    own: Sequence[str] = (),
    engine: str = "ngspice",
    intervals: str = "covariance",
    weighting: Literal["modulus", "unit"] = "modulus",
    progress: Any = None,
    displacement: Any = None,
    scale: Given | None = None,
    fps: float | None = None,
    axis: str | None = None,
    **arrays: ArrayLike,
) -> Identification:
    """Return the circuit and the coupling of a strip, fitted to measurements, with errors, intervals and findings.

    Parameters
    ----------
    data : str, Path, DataFrame, mapping, Record, Spectrum or a list of these
        A path, a data frame or mapping with columns as in a CSV file (time_s, voltage_V, current_mA, displacement_mm;
        or frequency_Hz, re_ohm, im_ohm), what `read` returned, or a list of these, of one strip.
    strip : Actuator, str or Path
        Geometry, Young's modulus and density: an object, a path or a preset's name (default: the paper's, which is
        said in a finding).
    model : str
        Name of an electrical model, or "auto": the simplest of the best by BIC.
    onset : float or str, optional
        When a record's excitation began, see `read`.
    electrode_resistance : float or str, optional
        Re [ohm], held (default: the strip's), or "fit" with nonlinear models.
    bias : float or str
        Bias [V] of a spectrum, or of each set of data.
    until : float or str, optional
        Time [s] since the onset up to which records are fitted.
    displacement_delay : float or str, optional
        How much later [s] the displacement's clock reads, or "fit" (default: fitted where the displacement is of a
        file of its own, else 0).
    own : sequence of str
        Parameters that each set of data has for itself.
    engine : {"ngspice", "exact"}
        "ngspice" judges the answer by a transient of its own, "exact" by the closed form.
    intervals : str
        Method of the 95 % intervals: "covariance", "profile", "bootstrap" or "mcmc".
    weighting : {"modulus", "unit"}
        Of spectra: "modulus" or "unit".
    progress : callable, optional
        Called after each evaluation.
    displacement : str, Path, DataFrame, mapping, tuple of two arrays, or list of these; optional
        The displacement of each record on a clock of its own, see `read`.
    scale : str or float, optional
        Size of a camera's pixel, see `read`.
    fps : float, optional
        Frames a second, see `read`.
    axis : str, optional
        Direction of the displacement, see `read`.
    **arrays : array_like
        Arrays in SI units in place of ``data``, see `read`.

    Returns
    -------
    Identification
        Parameters with intervals, the fitted strip, residuals, findings.

    Raises
    ------
    InputError
        The data hold no answer, or an argument is not understood.
    SolveError
        No fit converges.

    Examples
    --------
    >>> import numpy as np
    >>> import ilg_circuit as ilg
    >>> t = np.arange(-5.0, 60.0, 0.25)
    >>> current = np.where(t < 0, 0.0, 4 / 600 + 4 / 20 * np.exp(-t / 7)) + 1e-4 * np.sin(1e3 * t)
    >>> fit = ilg.identify(time=t, voltage=np.where(t < 0, 0.0, 4.0), current=current, model="rc", onset=0.0)
    >>> round(fit.parameters["dynamic_resistance"].value)
    20
    """
    if (data is None) == (not arrays):
        raise InputError("give data, or arrays by keyword such as time=, voltage=, current=")
    arrays, displacement = one_of(arrays, displacement)
    film = {"displacement": displacement, "scale": scale, "fps": fps, "axis": axis}
    sets = sets_of(by_header(arrays) if data is None else data, onset, **film)
    if any(isinstance(each, LoadTest) for each in sets):
        raise InputError("a load test says nothing of a circuit; fit it by ilg.ogden, or the command ogden")
    delay, resistance = displacement_delay, electrode_resistance
    return fit(
        sets,
        base=None if strip is None else load(strip),
        model=model,
        electrode_resistance=resistance if resistance in (None, "fit") else quantity(resistance, "ohm", "Re"),
        own=own,
        bias=_each(bias, len(sets)),
        engine=engine,
        intervals=intervals,
        weighting=weighting,
        displacement_delay=delay if delay in (None, "fit") else quantity(delay, "s", "displacement_delay"),
        until=None if until is None else quantity(until, "s", "until"),
        progress=progress,
    )


def ogden(
    uniaxial: Source | None = None,
    equibiaxial: Source | None = None,
    planar: Source | None = None,
    **options: Any,
) -> Characterisation:
    """Return the hyperelastic material fitted to load tests, all of them together, with predictions and findings.

    Parameters
    ----------
    uniaxial : str, Path, DataFrame, mapping or LoadTest, optional
        A path, a data frame or mapping with columns stretch and stress_MPa (nominal), or what `read` returned.
    equibiaxial : str, Path, DataFrame, mapping or LoadTest, optional
        Likewise.
    planar : str, Path, DataFrame, mapping or LoadTest, optional
        Likewise.
    **options : Any
        ``model``, ``terms``, ``constrained``, ``weighting``, ``at``, ``branch``, ``seed`` of
        `hyperelastic.characterise`.

    Returns
    -------
    Characterisation
        Material, predictions, findings.

    Raises
    ------
    InputError
        No test was given, or one cannot be read.
    SolveError
        No material fits.

    Examples
    --------
    >>> import numpy as np
    >>> import ilg_circuit as ilg
    >>> stretch = np.linspace(1.05, 2.0, 20)
    >>> gel = ilg.ogden({"stretch": stretch, "stress_kPa": 3 * (stretch - stretch**-2)}, model="neo-hookean")
    >>> gel.success, f"{gel.material.mu[0] / 1e3:.2f} kPa"
    (True, '3.00 kPa')
    """
    given = {"uniaxial": uniaxial, "equibiaxial": equibiaxial, "planar": planar}
    tests = [read(source, mode=mode) for mode, source in given.items() if source is not None]
    if not tests:
        raise InputError("no test was given; give at least one of uniaxial, equibiaxial, planar")
    return characterise(tests, **options)


def _each(bias: Given | Sequence[Given] | None, count: int) -> list[float] | None:
    if bias is None:
        return None
    given = [bias] * count if isinstance(bias, str | float | int) else list(bias)
    return [quantity(each, "V", "bias") for each in given]
