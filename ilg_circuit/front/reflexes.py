"""Neurons that feel the strip they drive: what users give, as the room `oscillators` takes it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TypedDict, Unpack, overload

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import one_thread
from ..errors import InputError, argument, checked
from ..oscillators.entrainment import Entrainment, entrainment
from ..oscillators.loop_rhythm import loop_rhythm
from ..oscillators.loop_run import ReflexRun, ReflexSweep, reflex_sweep, run_loop
from ..oscillators.network import ADAPTATION, ADAPTATION_TIME, RISE_TIME, TONIC, checked_start, wired
from ..oscillators.reflex import looped
from ..oscillators.run import default_times, start_of
from ..oscillators.sweep import swept_values
from ..simulation.response import sample_times
from .given import Given, Strip, load, optional, quantity


class Felt(TypedDict, total=False):
    """The options of `reflex` that define its loop."""

    rest_angle: float
    voltage: Given
    reference: float | None
    topology: str | None
    neurons: int | None
    weights: str | Path | ArrayLike | None
    inhibition: float | None
    same: float | None
    cross: float | None
    adaptation: float
    tonic: float
    rise_time: Given
    adaptation_time: Given
    start: str | ArrayLike | None


@overload
def reflex(
    duration: Given,
    strip: Strip = "paper",
    gain: float = 0.0,
    *,
    samples: int | None = None,
    step: Given | None = None,
    engine: str = "ode",
    **felt: Unpack[Felt],
) -> ReflexRun: ...


@overload
def reflex(
    duration: None = None,
    strip: Strip = "paper",
    gain: float = 0.0,
    *,
    sweep: str,
    progress: Callable[[int, int], None] | None = None,
    **felt: Unpack[Felt],
) -> ReflexSweep: ...


@overload
def reflex(
    duration: None = None,
    strip: Strip = "paper",
    gain: float = 0.0,
    *,
    entrain: float,
    frequencies: ArrayLike | None = None,
    progress: Callable[[int, int], None] | None = None,
    **felt: Unpack[Felt],
) -> Entrainment: ...


@checked
@one_thread()
def reflex(
    duration: Given | None = None,
    strip: Strip = "paper",
    gain: float = 0.0,
    *,
    rest_angle: float = 0.0,
    voltage: Given = "4V",
    reference: float | None = None,
    sweep: str | None = None,
    entrain: float | None = None,
    frequencies: ArrayLike | None = None,
    topology: str | None = None,
    neurons: int | None = None,
    weights: str | Path | ArrayLike | None = None,
    inhibition: float | None = None,
    same: float | None = None,
    cross: float | None = None,
    adaptation: float = ADAPTATION,
    tonic: float = TONIC,
    rise_time: Given = RISE_TIME,
    adaptation_time: Given = ADAPTATION_TIME,
    start: str | ArrayLike | None = None,
    samples: int | None = None,
    step: Given | None = None,
    engine: str = "ode",
    progress: Callable[[int, int], None] | None = None,
) -> ReflexRun | ReflexSweep | Entrainment:
    """Return the rhythm of neurons that drive a strip and feel its angle: waves, period, angle, phase.

    With ``sweep`` it returns the rhythm over the gain, with ``entrain`` the frequencies of an input to which the rhythm
    locks. Each pair of neurons (unit) drives a segment of the strip, one pair the whole strip. The input
    s = -gain (angle - rest_angle) enters the extensor, -s the flexor.

    Parameters
    ----------
    duration : float or str, optional
        Duration of the run [s], or a text such as "60 s"; not with ``sweep`` or ``entrain``.
    strip : Actuator, str or Path
        Strip that the neurons drive: an object, the path of a TOML file or a preset's name.
    gain : float
        Gain h of the reflex [1/rad]. Above zero a bend excites the neuron of the other side (stretch reflex), below
        zero it excites its own.
    rest_angle : float
        Angle at which the reflex is silent [rad].
    voltage : float or str
        Largest voltage on a segment [V].
    reference : float, optional
        Output of a unit that gives this voltage (default: the amplitude of the neurons' own rhythm).
    sweep : str, optional
        Gains to go through, such as "reflex=0:10:21": 21 values from 0 to 10.
    entrain : float, optional
        Amplitude of a sine that enters the neurons, in units of their tonic input.
    frequencies : array_like, optional
        Frequencies of this sine [Hz] (n,) at which phase or drift is computed (default: across the range that locks).
    topology, neurons, weights, inhibition, same, cross : optional
        Network of the neurons, as in `ilg.cpg`.
    adaptation, tonic, rise_time, adaptation_time, start : optional
        Constants of the neurons and their start, as in `ilg.cpg`.
    samples : int, optional
        Number of samples (default: a hundred in the shorter time constant).
    step : float or str, optional
        Time between samples [s], in place of their number.
    engine : {"ode", "ngspice"}
        Solver: "ode" is exact for a linear strip, "ngspice" solves neurons, strips and feedback as one circuit.
    progress : callable, optional
        Function that is called with (done, total) by ``sweep`` and ``entrain``.

    Returns
    -------
    ReflexRun, ReflexSweep or Entrainment
        A run has ``time`` [s] and ``angles`` [rad] (t, units), ``rhythm`` and ``without``; a sweep has ``period`` over
        ``gain``; an entrainment ``low`` and ``high`` [Hz]. See `ilg.results`.

    Raises
    ------
    InputError
        A value is out of range, arguments contradict one another, or the strip cannot bend.
    SolveError
        ngspice fails.

    Examples
    --------
    >>> import ilg_circuit as ilg
    >>> run = ilg.reflex("20 s", "paper", 10, inhibition=4.5)
    >>> f"{run.period:.2f} s, without the reflex {run.without.outcome}"
    '4.07 s, without the reflex rest'
    """
    network = wired(
        topology=topology,
        neurons=neurons,
        weights=weights,
        inhibition=inhibition,
        same=same,
        cross=cross,
        adaptation=adaptation,
        tonic=tonic,
        rise_time=rise_time,
        adaptation_time=adaptation_time,
    )
    neurons_start = checked_start(network, start_of(start))
    volts = quantity(voltage, "V", "voltage")
    loop = looped(network, load(strip), gain, reference=reference, rest_angle=rest_angle, voltage=volts)
    if sweep is None and entrain is None:
        if frequencies is not None:
            raise InputError(f"{argument('frequencies')} belong to {argument('entrain')}; give both or none")
        if duration is None:
            raise InputError(f"{argument('duration')} is missing; say how long, such as {argument('duration', '10s')}")
        seconds = quantity(duration, "s", "duration")
        if samples is None and step is None:
            times = default_times(network, seconds)
        else:
            times = sample_times(seconds, samples=samples, step=optional(step, "s", "step"))
        return run_loop(loop, times, neurons_start, engine=engine)
    if sweep is not None and entrain is not None:
        raise InputError(f"give {argument('sweep')} or {argument('entrain')}, not both")
    what = "a sweep" if sweep is not None else "entrainment"
    if engine != "ode":
        raise InputError(f"{what} is solved by {argument('engine', 'ode')}; leave out {argument('engine')}")
    unused = {"duration": duration, "samples": samples, "step": step}
    for name in (name for name, value in unused.items() if value is not None):
        raise InputError(f"{what} follows each rhythm to its end; leave out {argument(name)}")
    if sweep is not None:
        if sweep.partition("=")[0].strip() != "reflex":
            raise InputError(
                f"with a strip, {argument('sweep')} goes through gains: reflex=0:10:21; leave out the strip else"
            )
        return reflex_sweep(loop, swept_values(sweep, "", "reflex=0:10:21"), neurons_start, progress)
    assert entrain is not None
    given = None if frequencies is None else np.atleast_1d(np.asarray(frequencies, dtype=float))
    return entrainment(loop_rhythm(loop, neurons_start), entrain, given, progress)
