"""Runs of a network at given times."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, TypedDict, Unpack, overload

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array, plain
from ..errors import InputError, argument, checked
from ..files import write_text
from ..findings import Finding, Warned
from ..result import Column, Result
from ..simulation.response import sample_times
from ..units import require_positive, si
from .flow import Flow, sampled
from .network import ADAPTATION, ADAPTATION_TIME, RISE_TIME, TONIC, Network, checked_start, wired
from .outcome import Rhythm
from .rhythm import rhythm
from .sweep import RhythmSweep, cpg_sweep
from .symmetry import quotient

ENGINES = ("ode", "ngspice")
#: Samples in the shorter of the two time constants, unless asked for otherwise; and how many at most.
_SAMPLES_PER_CONSTANT = 100
_MOST_DEFAULT_SAMPLES = 100_000


@dataclass(frozen=True, repr=False, eq=False)
class RhythmRun(Result, Warned):
    """The motion of a network of n neurons, as `ilg_circuit.cpg` returns it.

    Attributes
    ----------
    time : ndarray (t,)
        Times [s].
    outputs : ndarray (t, n)
        Outputs y = max(x, 0) of the neurons.
    unit_outputs : ndarray (t, units)
        Output of the extensor minus that of the flexor, of every unit.
    states : ndarray (t, 2 n)
        Membrane states x and fatigue states v; v is NaN if ngspice solved the network.
    period : float or None
        Period [s], None without a rhythm.
    amplitude : float
        Amplitude of the output.
    rhythm : Rhythm
        Long-term behaviour: the cycle or the states of rest.
    network : Network
        Neurons, weights and constants.
    engine : str
        What solved the network: "ode" or "ngspice".
    error : float
        Error of period and amplitude estimated by ngspice, relative.
    wave_error : float
        Error of x over time estimated by ngspice, relative; 0 for "ode".
    warnings : tuple of str
        Findings as sentences.
    """

    presenter: ClassVar[str] = "cpg"

    network: Network
    engine: str
    time: Array
    states: Array
    rhythm: Rhythm
    period: float | None
    amplitude: float
    error: float
    wave_error: float

    @property
    def outputs(self) -> Array:
        """Outputs of the neurons, y = max(x, 0) (t, n)."""
        return np.maximum(self.states[:, : self.network.size], 0)

    @property
    def unit_outputs(self) -> Array:
        """Output of the extensor minus that of the flexor, of every unit (t, units)."""
        return self.outputs @ self.network.readout.T

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Findings about the rhythm, and about a duration too short to show it."""
        return (*self.rhythm.findings, *_about_duration(self.rhythm, float(self.time[-1])))

    def write_deck(self, path: str | Path) -> None:
        """Write the network as a SPICE deck of the same duration, which ``ngspice -b`` runs.

        Parameters
        ----------
        path : str or Path
            The file to write; it is replaced whole or not at all.

        Raises
        ------
        InputError
            The file cannot be written.
        """
        from .netlist import deck

        end = float(self.time[-1])
        write_text(Path(path), deck(self.network, end, self.rhythm.start, provenance=self.provenance))

    def table(self) -> tuple[Column, ...]:
        """Return time, neuron_1.., output (y_1 - y_2), and for a chain unit_1.. ."""
        neurons = [(f"neuron_{k + 1}", y) for k, y in enumerate(self.outputs.T)]
        units = [(f"unit_{k + 1}", y) for k, y in enumerate(self.unit_outputs.T)] if len(self.network.units) > 1 else []
        waves = [*neurons, ("output", self.unit_outputs[:, 0]), *units]
        return (Column("time", self.time, "s", over=True), *(Column(name, y, "") for name, y in waves))

    def to_dict(self) -> dict[str, Any]:
        """Return outcome, period, amplitude, lags, states of rest and the network as JSON-ready values."""
        end, network = self.rhythm, self.network
        content: dict[str, Any] = {
            "oscillates": end.oscillates,
            "period_s": self.period,
            "amplitude": self.amplitude,
            "frequency_Hz": 1 / self.period if self.period else None,
            "outcome": end.outcome,
            "reason": end.reason,
            "phase_lags_deg": plain(end.phase_lags),
            "engine": self.engine,
            "estimated_error": self.error,
            "estimated_wave_error": self.wave_error,
            "floquet_multiplier": end.cycle.multiplier if end.cycle else None,
            "settled_s": end.settled,
            "rest_outputs": plain(np.maximum(end.rest[: network.size], 0)) if end.rest is not None else None,
            "rest_states": [
                {"active": list(s.active), "stable": s.stable, "growth_per_s": s.growth} for s in end.rest_states.states
            ],
            "rest_states_complete": end.rest_states.complete,
            "rest_states_found_by": end.rest_states.how,
            "warnings": list(self.warnings),
            "network": {
                "neurons": network.size,
                "weights": network.matrix.tolist(),
                "adaptation": network.adaptation,
                "tonic": network.tonic,
                "rise_time_s": network.rise_time,
                "adaptation_time_s": network.adaptation_time,
                "start": end.start.tolist(),
            },
        }
        if len(network.units) > 1:
            content["unit_lags_deg"] = plain(end.unit_lags)
            content["unit_amplitudes"] = plain(end.swing)
        return content


def default_times(network: Network, duration: float) -> Array:
    """Return times from 0 to ``duration`` [s], a round step apart.

    At least a hundred in the shorter time constant, but no more than a hundred thousand. Raises InputError for a
    duration that is not positive.
    """
    require_positive("duration", duration, "s")
    shorter = min(network.rise_time, network.adaptation_time, duration)
    step = max(shorter / _SAMPLES_PER_CONSTANT, duration / _MOST_DEFAULT_SAMPLES)
    decade = 10.0 ** math.floor(math.log10(step))
    rounded = decade * max(k for k in (1, 2, 5) if k * decade <= step * (1 + 1e-12))
    if duration / rounded > _MOST_DEFAULT_SAMPLES:  # rounding down makes more of them
        return sample_times(duration, samples=_MOST_DEFAULT_SAMPLES + 1)
    return sample_times(duration, step=rounded)


def run(
    network: Network,
    times: ArrayLike,
    start: ArrayLike | None = None,
    *,
    engine: str = "ode",
    known: Rhythm | None = None,
    progress: Callable[[float, float], None] | None = None,
) -> RhythmRun:
    """Return a run of ``network`` at ``times`` [s], ascending from >= 0, with its long-term behaviour.

    ``engine`` "ode" is the exact flow, "ngspice" the netlist. The former calls ``progress(time, end)``. The behaviour
    of the same network and start may be ``known``. Raises InputError for times or an engine that are not allowed,
    SolveError where ngspice fails.
    """
    samples = np.asarray(times, dtype=float)
    if samples.ndim != 1 or not len(samples) or not np.isfinite(samples).all() or samples[0] < 0:
        raise InputError("the times of a run must be finite and not negative")
    if (np.diff(samples) <= 0).any():
        raise InputError("the times of a run must ascend")
    require_positive("duration", samples[-1], "s")
    if engine not in ENGINES:
        raise InputError(f"engine is '{engine}'; choose {' or '.join(ENGINES)}")
    state = checked_start(network, start)
    end = known or rhythm(network, state)
    period, amplitude, error, wave_error = end.period, end.amplitude, 0.0, 0.0
    if engine == "ode":
        classes = quotient(network, state)
        duration = float(samples[-1])
        tell = None if progress is None else lambda time: progress(min(time, duration), duration)
        states = classes.unfolded(sampled(Flow(classes.network), classes.folded(state), samples, tell))
        if progress:
            progress(duration, duration)
    else:
        from .netlist import measured, sampled_by_ngspice

        inner, wave_error = sampled_by_ngspice(network, samples, state)
        states = np.hstack([inner, np.full_like(inner, np.nan)])
        if end.cycle is not None:
            period, amplitude, error = measured(end)
    return RhythmRun(network, engine, samples, states, end, period, amplitude, error, wave_error)


def _about_duration(end: Rhythm, duration: float) -> tuple[Finding, ...]:
    if end.period is not None and duration < end.period:
        return (Finding("cpg-no-period", values={"duration": duration, "period": end.period}),)
    if end.period is not None and duration < end.settled + end.period:
        return (Finding("cpg-unsettled-cycle", values={"duration": duration, "settled": end.settled}),)
    if end.outcome == "rest" and duration < end.settled:
        return (Finding("cpg-unsettled-rest", values={"duration": duration}),)
    return ()


class Wiring(TypedDict, total=False):
    """The options of `cpg` that define its network."""

    topology: str | None
    neurons: int | None
    weights: str | Path | ArrayLike | None
    inhibition: float | None
    same: float | None
    cross: float | None
    adaptation: float
    tonic: float
    rise_time: str | float
    adaptation_time: str | float
    start: str | ArrayLike | None


@overload
def cpg(
    duration: str | float,
    *,
    samples: int | None = None,
    step: str | float | None = None,
    engine: str = "ode",
    sweep: None = None,
    progress: Callable[[float, float], None] | None = None,
    **wiring: Unpack[Wiring],
) -> RhythmRun: ...


@overload
def cpg(
    duration: None = None,
    *,
    sweep: str,
    progress: Callable[[int, int], None] | None = None,
    **wiring: Unpack[Wiring],
) -> RhythmSweep: ...


@checked
def cpg(
    duration: str | float | None = None,
    *,
    topology: str | None = None,
    neurons: int | None = None,
    weights: str | Path | ArrayLike | None = None,
    inhibition: float | None = None,
    same: float | None = None,
    cross: float | None = None,
    adaptation: float = ADAPTATION,
    tonic: float = TONIC,
    rise_time: str | float = RISE_TIME,
    adaptation_time: str | float = ADAPTATION_TIME,
    start: str | ArrayLike | None = None,
    samples: int | None = None,
    step: str | float | None = None,
    engine: str = "ode",
    sweep: str | None = None,
    progress: Callable[[Any, Any], None] | None = None,
) -> RhythmRun | RhythmSweep:
    """Return the outputs over time of a central pattern generator, and its rhythm: period, amplitude, phases.

    With ``sweep`` it returns the rhythm over a parameter instead.

    Parameters
    ----------
    duration : float or str, optional
        Duration [s], or a text such as "10 s"; not with ``sweep``.
    topology : {"mutual", "ring", "one-way-ring", "chain"}, optional
        How neurons inhibit each other (default mutual).
    neurons : int, optional
        Number of neurons (default 2; 3 in a ring; 30 in a chain).
    weights : str, Path or array_like, optional
        Weights W (n, n) or a CSV file of them, in place of a topology; row i holds what inhibits neuron i.
    inhibition : float, optional
        Mutual inhibition a: every weight of the topology (default 2.5).
    same : float, optional
        Coupling of a chain to the same neuron of the unit before (default 0.1).
    cross : float, optional
        Coupling of a chain to the other neuron of the unit before (default 0.1).
    adaptation : float
        Strength d of the adaptation (fatigue).
    tonic : float
        Tonic input e of each neuron.
    rise_time : float or str
        Time constant Tr of the state x [s].
    adaptation_time : float or str
        Time constant Ta of the adaptation v [s].
    start : array_like or str, optional
        States x of each neuron, then v of each (default: the paper's), or a text such as "0.12,0,0,0".
    samples : int, optional
        Number of samples (default: a hundred in the shorter time constant).
    step : float or str, optional
        Time between samples [s], in place of their number.
    engine : {"ode", "ngspice"}
        Solver: "ode" is exact between thresholds, "ngspice" solves the neurons as a circuit.
    sweep : str, optional
        A parameter to vary, such as "inhibition=1:5:41": 41 values from 1 to 5.
    progress : callable, optional
        Function that is called with (time, end) [s], or in a sweep with (done, total).

    Returns
    -------
    RhythmRun or RhythmSweep
        ``time`` [s], ``outputs`` (t, n), ``period`` [s] and ``amplitude``; with ``sweep`` arrays of ``period`` and
        ``amplitude`` over ``values``. See `ilg.results`.

    Raises
    ------
    InputError
        A value is out of range, or arguments contradict one another.
    SolveError
        ngspice fails.

    Examples
    --------
    >>> import ilg_circuit as ilg
    >>> ilg.cpg("10 s").rhythm.oscillates
    True
    >>> ilg.cpg(sweep="inhibition=1:3:3").oscillates.tolist()
    [False, True, True]
    """
    wiring: dict[str, Any] = {
        "topology": topology,
        "neurons": neurons,
        "weights": weights,
        "inhibition": inhibition,
        "same": same,
        "cross": cross,
        "rise_time": rise_time,
        "adaptation_time": adaptation_time,
        "adaptation": adaptation,
        "tonic": tonic,
    }
    begun = start_of(start)
    if sweep is not None:
        if engine != "ode":
            raise InputError(f"a sweep is solved by {argument('engine', 'ode')}; leave out {argument('engine')}")
        unused = {"duration": duration, "samples": samples, "step": step}
        for name in (name for name, value in unused.items() if value is not None):
            raise InputError(f"a sweep follows each network to its end; leave out {argument(name)}")
        return cpg_sweep(sweep, start=begun, progress=progress, **wiring)
    if duration is None:
        raise InputError(f"{argument('duration')} is missing; say how long, such as {argument('duration', '10s')}")
    network = wired(**wiring)
    seconds = si(duration, "s", argument("duration"))
    if samples is None and step is None:
        times = default_times(network, seconds)
    else:
        times = sample_times(seconds, samples=samples, step=None if step is None else si(step, "s", argument("step")))
    return run(network, times, begun, engine=engine, progress=progress)


def start_of(text: str | ArrayLike | None) -> ArrayLike | None:
    """Return a start given as a text such as ``0.12,0,0,0``, or as it is. Raises InputError for another text."""
    if not isinstance(text, str):
        return text
    try:
        return [float(cell) for cell in text.split(",")]
    except ValueError:
        raise InputError(f"{argument('start')} '{text[:40]}' is not a list of numbers; write 0.12,0,0,0") from None
