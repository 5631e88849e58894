"""Learning over repeated trials."""

from __future__ import annotations

from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import one_thread, row
from ..circuit.load import Hung, load_of
from ..control.learn import GAIN, NODES, TRIALS, Learned, Trial
from ..control.learn import learn as learn_room
from ..drive import PiecewiseLinear
from ..errors import InputError, argument, checked
from .given import Driven, Given, Strip, drive_of, lasting, optional, quantity
from .given import load as strip_of

#: A trial that was measured: a file with time, voltage and displacement, or these three (n,) [s, V, m].
Measured: TypeAlias = "str | Path | tuple[ArrayLike, ArrayLike, ArrayLike]"


@checked
@one_thread()
def learn(
    strip: Strip,
    path: Driven,
    duration: Given | None = None,
    *,
    trials: int = TRIALS,
    voltage: Given = 4.0,
    bandwidth: Given | None = None,
    gain: float = GAIN,
    nodes: int = NODES,
    trial: Measured | None = None,
    beam: str | None = None,
    load: Hung = None,
    draws: int | None = None,
    seed: int = 0,
) -> Learned:
    """Return how the error of a path falls over repeated trials, and the voltage for the next trial.

    Each trial begins at rest. Its voltage is that of the last one, corrected by what the fitted strip's inverse makes
    of the error, up to a bandwidth. The factor by which the error falls each trial is computed first, for every sample
    of the fit's covariance as the true strip.

    Parameters
    ----------
    strip : Actuator, str or Path
        An object, the path of a TOML file or a preset's name; a fitted strip brings the covariance.
    path : str, Drive or (times, values)
        Where the tip shall be: a text such as "sine:1mm,10mHz" or "file:path.csv" (the forms of `sense`), or a pair of
        times [s] and positions [m] (n,).
    duration : float or str, optional
        Duration of a trial [s]; not needed for a file or a pair of arrays, which end by themselves.
    trials : int
        Number of trials after the first.
    voltage : float or str
        Limit [V] of the voltage, of either sign. A trial that meets it has no promise.
    bandwidth : float or str, optional
        Highest frequency [Hz] that is learnt (default: a fifth of the nodes a second).
    gain : float
        Part of the correction that is made, above 0 and below 2; less than 1 learns slower, and less of the noise.
    nodes : int
        Number of points, equally apart, between which the voltage is straight.
    trial : str, Path or (time, voltage, displacement), optional
        A trial that was measured, from rest at its first row: a CSV file, or times [s], voltages [V] and displacements
        [m], each (n,). The next voltage follows from it.
    beam : {"dynamic", "static"}, optional
        Beam with or without its mass (default: as the coupling was fitted).
    load : Load, str or mapping, optional
        Load on the tip, such as "mass=1g".
    draws : int, optional
        Samples of the covariance (default 200; none for a strip without a covariance).
    seed : int
        Seed of the samples.

    Returns
    -------
    Learned
        ``contraction`` (samples,), ``promised`` (samples,), ``errors`` (samples, trials) and ``limits`` (samples,)
        [m, rms], ``drive`` for `simulate`, ``write_drive``. See `ilg.results`.

    Raises
    ------
    InputError
        A value is not understood or out of range, or the strip is nonlinear.

    Examples
    --------
    A trial on a strip that answers 10 % less than the one that was fitted, and the next voltage:

    >>> import ilg_circuit as ilg
    >>> path, how = "sine:2mm,5mHz", {"nodes": 41, "beam": "static"}
    >>> first = ilg.learn("paper", path, "200 s", **how).drive
    >>> true = ilg.load("paper").with_(thickness="0.527 mm")
    >>> done = ilg.simulate(true, first, "200 s", samples=81, beam="static", engine="exact")
    >>> trial = (done.time, done.voltage, done.displacement)
    >>> learned = ilg.learn("paper", path, "200 s", trial=trial, **how)
    >>> again = ilg.simulate(true, learned.drive, "200 s", samples=81, beam="static", engine="exact")
    >>> [f"{1e6 * abs(learned.path - run.displacement).max():.0f} um" for run in (done, again)]
    ['203 um', '23 um']
    """
    actuator = strip_of(strip)
    seconds = None if duration is None else quantity(duration, "s", "duration")
    source = drive_of(path, seconds or 0.0, "m")
    return learn_room(
        actuator,
        source,
        lasting(source, seconds),
        trials=trials,
        limit=quantity(voltage, "V", "voltage"),
        bandwidth=optional(bandwidth, "Hz", "bandwidth"),
        gain=gain,
        nodes=nodes,
        trial=None if trial is None else _trial(trial),
        beam=beam,
        load=load_of(load),
        draws=draws,
        seed=seed,
    )


def _trial(given: Measured) -> Trial:
    """Return a trial. Raises InputError for what is none."""
    if isinstance(given, str | Path):
        rows = [drive_of(f"file:{given}", 0.0, unit) for unit in ("V", "m")]
        volts, tip = (part for part in rows if isinstance(part, PiecewiseLinear))
        return Trial(volts.times, volts.values, np.interp(volts.times, tip.times, tip.values))
    if not (isinstance(given, tuple | list) and len(given) == 3):
        raise InputError(f"{argument('trial')} is a file, or times, voltages and displacements")
    names = ("times", "voltages", "displacements")
    time, voltage, moved = (row(part, f"{name} of the trial") for part, name in zip(given, names, strict=True))
    if not len(time) == len(voltage) == len(moved) > 1 or (np.diff(time) <= 0).any():
        raise InputError(f"{argument('trial')} has times that do not rise, or not as many of each")
    return Trial(time - time[0], voltage, moved)
