"""Parameters from measurements: of a strip, of a gel."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from inspect import signature
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import row
from ..errors import InputError, argument, checked, unknown_name
from ..hyperelastic import Characterisation, characterise
from ..identification.identification import Identification
from ..identification.identify import identify as fit
from ..measurements.load_test import LoadTest
from ..measurements.onset import Stated
from ..measurements.record import Record
from ..measurements.said import said_of
from ..measurements.spectrum import Spectrum
from ..solve.library import chosen_engine
from ..strip.models import electrical_model
from ..strip.specimen import Specimen
from .data import Source, by_header, one_of, read, sets_of
from .each_file import values_of
from .given import Driven, Given, Strip, quantity
from .strips import measured_strip


@checked
def identify(
    data: Source | Sequence[Source] | None = None,
    strip: Strip | Specimen | None = None,
    *,
    model: str = "auto",
    onset: Stated | str | Mapping[str, Stated | str] = None,
    electrode_resistance: Given | Literal["fit"] | None = None,
    bias: Given | Sequence[Given] | Mapping[str, Given] | None = None,
    until: Given | None = None,
    displacement_delay: Given | Literal["fit"] | None = None,
    coupling: str = "auto",
    own: Sequence[str] = (),
    engine: str | None = None,
    intervals: str = "covariance",
    weighting: Literal["modulus", "unit"] = "modulus",
    columns: Mapping[str, str] | Iterable[str] = (),
    units: Mapping[str, str] | Iterable[str] = (),
    part: int | str | None = None,
    cycle: int | None = None,
    length: Given | None = None,
    free_length: Given | None = None,
    width: Given | None = None,
    thickness: Given | None = None,
    load_position: Given | None = None,
    youngs_modulus: Given | None = None,
    density: Given | None = None,
    bending_stiffness: Given | None = None,
    orientation: str | None = None,
    progress: Callable[..., Any] | None = None,
    displacement: Any = None,
    drive: Driven | Mapping[str, Driven] | None = None,
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
    strip : Actuator, Specimen, str or Path
        Geometry, Young's modulus and density: an object, such as `new_strip` returns, a path or a preset's name
        (default: the paper's, stated in a finding).
    model : str
        Name of an electrical model, such as "rc" or "rc2+sinh" (all are under Notes), or "auto": the simplest of those
        that fit about as well as the best by BIC.
    onset : float, str or mapping, optional
        When a record's excitation began, see `read`; or a mapping from the name of a file to it, ``"*"`` being all
        others.
    electrode_resistance : float or str, optional
        Re [ohm], held (default: the strip's), or "fit" with nonlinear models.
    bias : float, str, sequence or mapping, optional
        Bias [V] of a spectrum, or of each set of data, or by the name of a file as with ``onset``.
    until : float or str, optional
        Time [s] since the onset up to which records are fitted.
    displacement_delay : float or str, optional
        How much later [s] the displacement's clock reads, or "fit" (default: fitted where the displacement is of a
        file of its own, else 0).
    coupling : {"auto", "ec31", "charge1", "charge2", "voltage1", "voltage2", "voltage3", "fractional"}
        Law by which the strip bends: d(s) of the voltage, or the ions' charge, or their voltage, through so many
        relaxations; "auto": chosen by BIC as the model is.
    own : sequence of str
        Parameters of which each set of data gets a value of its own; all others are shared.
    engine : {"ngspice", "exact"}, optional
        What checks the fitted circuit: "ngspice" by a transient analysis, "exact" by the closed form (default:
        ngspice; without its library exact for linear models, with a warning).
    intervals : str
        Method of the 95 % intervals: "covariance", "profile", "bootstrap" or "mcmc".
    weighting : {"modulus", "unit"}
        Weights of impedances: "modulus" divides residuals by abs(Z), "unit" does not weight them.
    columns, units : mapping of str to str, optional
        Statements that the files lack, see `read`.
    part, cycle : int, optional
        Which of several measurements in a file, see `read`.
    length, free_length, width, thickness : float or str, optional
        Sizes of the strip [m], in place of its own, or all four in place of ``strip``.
    load_position, youngs_modulus, density, bending_stiffness : float or str, optional
        Likewise, see `new_strip`.
    orientation : {"weightless", "hanging", "horizontal"}, optional
        Likewise.
    progress : callable, optional
        Called after each evaluation.
    displacement : str, Path, DataFrame, mapping, tuple of two arrays, or list of these; optional
        The displacement of each record on a clock of its own, see `read`.
    drive : str, tuple, Drive or mapping, optional
        The voltage under which data hold a displacement alone, such as "step:2V", see `simulate`; or a mapping from
        the name of a file to it. Such data are columns of time and displacement, or x and y; what is fitted is the
        coupling and how much later their clock reads than the drive's, unless ``onset`` (when the drive's voltage
        began, by their clock) or ``displacement_delay`` states it. The circuit is taken from ``strip``.
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
        ``parameters`` maps names, listed under Notes, to estimates with ``value``, ``stderr`` and ``interval``;
        ``fit["capacitance"]`` is one of them. ``actuator`` is the fitted strip, ``warnings`` list doubtful points.
        ``success`` is False where the misfit is so large that the parameters mean nothing; what the data do not
        determine has a wide or open interval, and a finding. See `ilg.results`.

    Raises
    ------
    InputError
        The data hold no answer, or an argument is not understood.
    SolveError
        No fit converges.

    Notes
    -----
    All models have the parameters dc_resistance and electrode_resistance [ohm]. A displacement adds coupling_gain
    [m/(V s)], coupling_zero [1/s], coupling_damping_ratio and coupling_natural_frequency [1/s], or, with another
    ``coupling``, sizes of coupling_gain_1 [m/V] and so on, and coupling_time_1 [s]. The others depend on
    the model; randles, +saturating and +steric are not tried by "auto":

    ===========  =====================================================================================================
    rc           dynamic_resistance [ohm], capacitance [F]
    rc2, rc3     resistance_1 [ohm], capacitance_1 [F], resistance_2, capacitance_2 (and resistance_3, capacitance_3)
    warburg      series_resistance, warburg_resistance [ohm], diffusion_time [s]
    cpe          series_resistance [ohm], cpe_coefficient [F s^(a-1)], cpe_exponent
    randles      series_resistance, interface_resistance, warburg_resistance [ohm], interface_time, diffusion_time
                 [s], interface_exponent, diffusion_exponent
    +sinh        adds emission_voltage [V]: the electron path conducts more at high voltage
    +growing     adds capacitance_slope [1/V]: the capacitance of rc, rc2 or rc3 grows with voltage
    +saturating  adds saturation_voltage [V]: the charge of rc, rc2 or rc3 saturates
    +steric      adds packing_fraction: its ions have a size, the charge rises as the root of the voltage
    +inductance  adds inductance [H] at the terminals
    ===========  =====================================================================================================

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
    if data is not None and arrays:
        raise unknown_name("argument", next(iter(arrays)), [*signature(identify).parameters][:-1])
    if data is None and not arrays:
        raise InputError("give data, or arrays by keyword such as time=, voltage=, current=")
    base = measured_strip(
        strip,
        length=length,
        free_length=free_length,
        width=width,
        thickness=thickness,
        load_position=load_position,
        youngs_modulus=youngs_modulus,
        density=density,
        bending_stiffness=bending_stiffness,
        orientation=orientation,
    )
    arrays, displacement = one_of(arrays, displacement)
    said = said_of(columns, units, part, cycle, scale=scale, rate=fps, axis=axis)
    end = None if until is None else quantity(until, "s", "until")
    if drive is not None and displacement is not None:
        raise InputError(
            f"{argument('displacement')} stands beside a record, {argument('drive')} in place of one: give one of them"
        )
    if drive is not None and onset is not None and displacement_delay is not None:
        raise InputError(f"{argument('onset')} and {argument('displacement_delay')} state the same: give one of them")
    given = sets_of(by_header(arrays) if data is None else data, onset, said, displacement, drive, end)
    sets = [each for each in given if not isinstance(each, LoadTest)]
    if len(sets) < len(given):
        raise InputError("a load test cannot determine a circuit; fit it by ilg.ogden, or the command ogden")
    delay, resistance = displacement_delay, electrode_resistance
    return fit(
        sets,
        base=base,
        model=model,
        electrode_resistance=resistance if resistance in (None, "fit") else quantity(resistance, "ohm", "Re"),
        own=[own] if isinstance(own, str) else own,
        bias=_biases(bias, sets, data),
        engine=fit_engine(engine, model) if any(isinstance(each, Record) for each in sets) else engine or "ngspice",
        intervals=intervals,
        weighting=weighting,
        displacement_delay=delay if delay in (None, "fit") else quantity(delay, "s", "displacement_delay"),
        until=end,
        law=coupling,
        progress=progress,
    )


def fit_engine(engine: str | None, model: str) -> str:
    """Return the engine for a fit of a ``model``, of which "auto" chooses a linear one where it must."""
    return chosen_engine(engine, linear=model == "auto" or electrical_model(model).linear)


@checked
def ogden(
    uniaxial: Source | None = None,
    equibiaxial: Source | None = None,
    planar: Source | None = None,
    *,
    model: str = "auto",
    terms: int | None = None,
    weighting: str = "absolute",
    constrained: bool = True,
    at: ArrayLike = (),
    branch: str = "loading",
    seed: int = 0,
    columns: Mapping[str, str] | Iterable[str] = (),
    units: Mapping[str, str] | Iterable[str] = (),
    part: int | None = None,
    cycle: int | None = None,
    length: Given | None = None,
    section: Given | None = None,
) -> Characterisation:
    """Return the hyperelastic material fitted to load tests, all of them together, with predictions and findings.

    Parameters
    ----------
    uniaxial : str, Path, DataFrame, mapping or LoadTest, optional
        Test of a strip pulled along its length: a path, a data frame or mapping with columns stretch and stress_MPa
        (nominal), or the result of `read`.
    equibiaxial : str, Path, DataFrame, mapping or LoadTest, optional
        Test of a sheet pulled equally in both directions.
    planar : str, Path, DataFrame, mapping or LoadTest, optional
        Test of a wide, short sheet: pure shear.
    model : {"auto", "ogden", "neo-hookean", "mooney-rivlin"}
        Material; auto: chosen by BIC.
    terms : int, optional
        Number of Ogden terms, 1 to 4 (default: chosen by BIC).
    weighting : {"absolute", "relative"}
        Relative: residuals are parts of each stress, which follows small strains better.
    constrained : bool
        Keeps mu_i alpha_i > 0, so that the material is stable.
    at : array_like
        Stretches at which stresses are predicted.
    branch : {"loading", "unloading", "reloading", "all"}
        Rows that are fitted where a test goes back and forth.
    seed : int
        Seed of the random starts.
    columns : mapping of str to str, optional
        Titles of columns by quantity, as in `read`.
    units : mapping of str to str, optional
        Units by quantity, as in `read`.
    part : int, optional
        Which of several measurements in a file, from 1.
    cycle : int, optional
        Which cycle of a file.
    length : float or str, optional
        Free length of the specimens [m], where a displacement was measured.
    section : float or str, optional
        Their undeformed section [m^2], where a force was measured.

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
    if all(source is None for source in given.values()):
        names = ", ".join(map(argument, given))
        raise InputError(f"no test was given; give at least one of {names}")
    how: dict[str, Any] = {"columns": columns, "units": units, "part": part, "cycle": cycle}
    how |= {"length": length, "section": section}
    tests: list[LoadTest] = []
    for mode, source in given.items():
        test = read(source, mode=mode, **how) if source is not None else None
        if isinstance(test, LoadTest):
            tests.append(test)
        elif test is not None:
            raise InputError(f"a test is a {type(test).__name__}; give a load test: columns stretch and stress")
    return characterise(
        tests,
        model=model,
        terms=terms,
        weighting=weighting,
        constrained=constrained,
        at=row(np.atleast_1d(np.asarray(at, dtype=object)), "at"),
        branch=branch,
        seed=seed,
    )


def _biases(
    bias: Given | Sequence[Given] | Mapping[str, Given] | None, sets: Sequence[Any], data: Any
) -> list[float] | None:
    """Return the bias [V] of every set. Raises InputError for one of a file that is not a spectrum."""
    if bias is None:
        return None
    if isinstance(bias, Mapping):
        sources = data if isinstance(data, list | tuple) else [data]
        spectra = [k for k, each in enumerate(sets) if isinstance(each, Spectrum)]
        found = values_of(bias, sources, "bias", spectra, "the spectra among the files")
        return [0.0 if each is None else quantity(each, "V", "bias") for each in found]
    given = [bias] * len(sets) if isinstance(bias, str | float | int) else list(bias)
    return [quantity(each, "V", "bias") for each in given]
