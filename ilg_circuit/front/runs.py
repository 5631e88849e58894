"""Runs of a strip: its response to a drive, its impedance, its signal as a sensor."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

from numpy.typing import ArrayLike

from ..arrays import row
from ..circuit.load import Hung
from ..drive import voltage_limit
from ..errors import InputError, checked
from ..measurements.said import said_of
from ..simulation.check import check as check_response
from ..simulation.check import check_impedance
from ..simulation.impedance import Impedance, frequencies
from ..simulation.impedance import impedance as solve_impedance
from ..simulation.prediction_band import prediction_band
from ..simulation.response import Response
from ..simulation.response import simulate as solve
from ..simulation.sensing import Sensed
from ..simulation.sensing import sense as solve_sensed
from ..solve.library import chosen_engine
from ..solve.transient import Progress
from .compared import compared
from .data import Source
from .given import Driven, Given, Segmented, Strip, engine_of, mounted, quantity, run_of, wired_run
from .given import load as strip_of


@checked
def simulate(
    strip: Strip,
    drive: Driven | Segmented,
    duration: Given | None = None,
    *,
    samples: int | None = None,
    step: Given | None = None,
    times: ArrayLike | None = None,
    tip: str = "free",
    beam: str | None = None,
    load: Hung = None,
    engine: str | None = None,
    accuracy: float | None = None,
    band: bool = False,
    compare: Source | bool = False,
    check: bool = False,
    columns: Mapping[str, str] | Iterable[str] = (),
    units: Mapping[str, str] | Iterable[str] = (),
    part: int | None = None,
    cycle: int | None = None,
    progress: Progress | None = None,
) -> Response:
    """Return the current, displacement, force, charge and energy of a strip under a drive, over time.

    Parameters
    ----------
    strip : Actuator, str or Path
        An object, the path of a TOML file or a preset's name.
    drive : str, Drive, (times, values) or mapping
        The voltage over time: a text such as "step:4V" or "square:-2V..2V,30s" (all forms are under Notes), or a pair
        of times [s] and voltages [V] (n,). The strip is at rest under the drive's rest level until t = 0. With amperes
        it is a current, such as "current:10mA", and the voltage is an answer. Of a strip
        with segmented electrodes ``{1: "step:4V", 2: "step:-4V", 3: "open"}`` gives each segment of side 1 its own,
        against side 2; -2 is a segment of side 2, "3:-1" one of side 1 against one of side 2. Segments that are not
        named are at 0 V. A file with columns voltage_1_V, voltage_2_V, ... drives the segments of such a strip.
    duration : float or str
        Duration [s]; not needed if the drive is a pair of arrays.
    samples : int, optional
        Number of samples (default 601).
    step : float or str, optional
        Time between samples [s], in place of their number.
    times : array_like, optional
        The times themselves [s] (n,), in place of a duration.
    tip : {"free", "clamped"}
        Whether the tip moves.
    beam : {"dynamic", "static"}, optional
        Beam with or without its mass (default: as the coupling was fitted).
    load : Load, str or mapping, optional
        Load on the tip, such as "mass=1g" or ``{"mass": "1 g"}``.
    engine : {"ngspice", "exact"}, optional
        Solver: ngspice, or matrix exponentials, for linear circuits only (default: ngspice; without its library exact,
        with a warning).
    accuracy : float, optional
        Largest error allowed, relative to the largest value (default 1e-9, nonlinear 1e-6).
    band : bool
        Adds standard errors from the uncertainty of a fitted strip.
    compare : str, Path, DataFrame, Record or bool
        Measured record to compare with; True for the drive's own file, if it holds a current.
    check : bool
        Adds ``checks``, the differences from the other engine and the closed forms.
    columns : mapping of str to str, optional
        Titles of columns in the drive's file by quantity, if its headers are not understood; as in `read`.
    units : mapping of str to str, optional
        Units in the drive's file by quantity, likewise.
    part : int, optional
        Which of several measurements in the drive's file, from 1.
    cycle : int, optional
        Which cycle in the drive's file.
    progress : callable, optional
        Function that is called with (done, total) [s].

    Returns
    -------
    Response
        ``time`` [s] and the waveforms ``voltage`` [V], ``current`` [A], ``displacement`` [m], ``force`` [N], ``charge``
        [C] and ``energy`` [J], each an array (n,); ``account`` of the energies; ``warnings``. Of a strip with
        electrodes also ``curvatures`` along it and ``segments``, voltage and current of each; ``voltage`` is that of
        the first drive, ``current`` flows out of all sources from side 1 to side 2. See `ilg.results`.

    Raises
    ------
    InputError
        A value is not understood or out of range.
    SolveError
        The circuit cannot be solved to the accuracy.

    Notes
    -----
    Texts that name a drive; parts in brackets may be left out:

    ====================================  ============================================================================
    ``step:4V``                           A constant value from t = 0 on.
    ``square:4V,30s[,duty]``              The value and zero alternate. 30 s is the period; its first half (or the
                                          fraction duty) has the value. LOW..HIGH gives both levels.
    ``triangle:4V,30s``                   A triangular wave from zero to the value. 30 s is the period. LOW..HIGH
                                          gives both ends.
    ``cv:-1V..1V,50mV/s[,cycles]``        Cyclic voltammetry: a triangle between two values at this rate, endless or
                                          for a number of cycles.
    ``pulse:4V,1s,10s[,count]``           The value for 1 s in each period of 10 s, endless or count times.
    ``sine:2V,0.1Hz``                     A sine of this amplitude and frequency.
    ``chirp:1V,0.01Hz..1Hz``              A sine whose frequency rises or falls from the first to the second during
                                          the run.
    ``multisine:1V,0.01Hz..1Hz[,tones]``  A sum of 10 (or tones) sines between two frequencies, with this peak.
    ``ramp:1V/s``                         A straight line from zero.
    ``file:drive.csv``                    The rows of a CSV file: time_s and a voltage or, for a motion, a displacement.
    ``repeat:5,drive.csv``                The rows of a file, repeated 5 times.
    ``current:10mA[,limit=4V]``           A current in place of a voltage: a value, any form above with amperes, or a
                                          file's column of current; the source gives way beyond the limit.
    ====================================  ============================================================================

    Examples
    --------
    >>> import ilg_circuit as ilg
    >>> run = ilg.simulate("paper", "step:4V", "300 s", engine="exact")
    >>> f"{1e3 * run.displacement[-1]:.2f} mm"
    '3.98 mm'
    """
    actuator = strip_of(strip)
    said = said_of(columns, units, part, cycle)
    source, at, wires = wired_run(actuator, drive, duration, samples=samples, step=step, times=times, said=said)
    how = mounted(tip, beam, load)
    engine = "exact" if engine is None and voltage_limit(source) is not None else engine_of(engine, actuator)
    response = solve(actuator, source, at, engine=engine, accuracy=accuracy, progress=progress, wires=wires, **how)
    if band:
        stderr = prediction_band(actuator, source, response.time, engine=engine, wires=wires, **how).stderr
        response = replace(response, stderr=stderr)
    if wires is not None or isinstance(drive, Mapping):
        if not isinstance(compare, bool):
            raise InputError("a record has one voltage, and the segments have their own; leave compare out")
    elif compare is not False:
        until = float(response.time[-1])
        beside, findings = compared(actuator, drive, compare, until, said, engine=engine, band=band, **how)
        response = replace(response, compared=beside, findings=findings)
    return replace(response, checks=tuple(check_response(response, **how))) if check else response


@checked
def impedance(
    strip: Strip,
    low: Given = 1e-3,
    high: Given = 1e3,
    *,
    points: int | None = None,
    frequency: ArrayLike | None = None,
    bias: Given = 0.0,
    tip: str = "free",
    beam: str | None = None,
    load: Hung = None,
    engine: str | None = None,
    segment: int | None = None,
    check: bool = False,
) -> Impedance:
    """Return the impedance [ohm] that a strip shows at its terminals for a small signal.

    Parameters
    ----------
    strip : Actuator, str or Path
        An object, the path of a TOML file or a preset's name.
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
    tip : {"free", "clamped"}
        Whether the tip moves.
    beam : {"dynamic", "static"}, optional
        Beam with or without its mass (default: as the coupling was fitted).
    load : Load, str or mapping, optional
        Load on the tip, such as "mass=1g".
    engine : {"ngspice", "exact"}, optional
        Solver: ngspice, or the circuit's equations solved directly (default: ngspice; without its library exact, with a
        warning).
    segment : int, optional
        Segment of side 1 of a strip with electrodes at which it is seen, all others at 0 V (default: all joined).
    check : bool
        Adds ``checks``, the differences from the other engine and the closed form.

    Returns
    -------
    Impedance
        ``impedance`` [ohm], complex (f,), over ``frequency`` [Hz] (f,). See `ilg.results`.

    Raises
    ------
    InputError
        A value is not understood or out of range.
    SolveError
        The circuit cannot be solved.

    Examples
    --------
    >>> import ilg_circuit as ilg
    >>> spectrum = ilg.impedance("paper", "1 mHz", "10 Hz", engine="exact")
    >>> len(spectrum.frequency)
    41
    """
    actuator = strip_of(strip)
    band = quantity(low, "Hz", "low"), quantity(high, "Hz", "high")
    chosen = frequencies(*band, points) if frequency is None else row(frequency, "frequency")
    how = mounted(tip, beam, load) | {"bias": quantity(bias, "V", "bias")}
    by = chosen_engine(engine, linear=True)  # a small signal, about the bias
    result = solve_impedance(actuator, chosen, engine=by, segment=segment, **how)
    return replace(result, checks=tuple(check_impedance(result, **how))) if check else result


@checked
def sense(
    strip: Strip,
    motion: Driven,
    duration: Given | None = None,
    *,
    samples: int | None = None,
    step: Given | None = None,
    times: ArrayLike | None = None,
    terminals: str = "open",
    engine: str | None = None,
    accuracy: float | None = None,
    columns: Mapping[str, str] | Iterable[str] = (),
    units: Mapping[str, str] | Iterable[str] = (),
    part: int | None = None,
    cycle: int | None = None,
    progress: Progress | None = None,
) -> Sensed:
    """Return the voltage or the current at a strip's terminals while its tip is moved.

    Parameters
    ----------
    strip : Actuator, str or Path
        An object, the path of a TOML file or a preset's name.
    motion : str, Drive or (times, values)
        The position of the tip over time: a text such as "sine:1mm,0.1Hz" (the forms of `simulate`, with lengths in
        place of voltages), or a pair of times [s] and positions [m] (n,).
    duration : float or str
        Duration [s]; not needed if the motion is a pair of arrays.
    samples : int, optional
        Number of samples (default 601).
    step : float or str, optional
        Time between samples [s], in place of their number.
    times : array_like, optional
        The times themselves [s] (n,), in place of a duration.
    terminals : {"open", "short"}
        Open: the voltage between them; short: the current through them.
    engine : {"ngspice", "exact"}, optional
        Solver: ngspice, or matrix exponentials, for linear circuits only (default: ngspice; without its library exact,
        with a warning).
    accuracy : float, optional
        Largest error allowed, relative to the largest value (default 1e-9).
    columns : mapping of str to str, optional
        Titles of columns in the motion's file by quantity, if its headers are not understood; as in `read`.
    units : mapping of str to str, optional
        Units in the motion's file by quantity, likewise.
    part : int, optional
        Which of several measurements in the motion's file, from 1.
    cycle : int, optional
        Which cycle in the motion's file.
    progress : callable, optional
        Function that is called with (done, total) [s].

    Returns
    -------
    Sensed
        ``time`` [s] and the waveforms ``displacement`` [m], ``voltage`` [V], ``current`` [A], ``force`` [N] and
        ``charge`` [C], each an array (n,). See `ilg.results`.

    Raises
    ------
    InputError
        A value is not understood or out of range.
    SolveError
        The circuit cannot be solved.

    Examples
    --------
    >>> import ilg_circuit as ilg
    >>> sensed = ilg.sense("paper", "sine:1mm,0.1Hz", "20 s", engine="exact")
    >>> len(sensed.time)
    601
    """
    said = said_of(columns, units, part, cycle)
    source, at = run_of(motion, duration, "m", samples=samples, step=step, times=times, said=said)
    actuator = strip_of(strip)
    how: dict[str, Any] = {"terminals": terminals, "engine": engine_of(engine, actuator), "accuracy": accuracy}
    return solve_sensed(actuator, source, at, progress=progress, **how)
