"""Runs of neurons with a reflex at given times, and their rhythm over the gain of the reflex."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array, plain
from ..errors import InputError, argument, wrong_choice
from ..files import write_text
from ..findings import Finding, Warned
from ..result import Column, Result
from .flow import sampled
from .loop_rhythm import LoopRhythm, loop_rhythm
from .network import checked_start
from .reflex import Loop, LoopFlow
from .run import ENGINES
from .sweep import MOST_VALUES

#: Periods that a run must pass its middle to show a period, and by how much the last two may differ.
_PASSES, _ALIKE = 4, 0.02


@dataclass(frozen=True, repr=False, eq=False)
class ReflexRun(Result, Warned):
    """The motion of neurons that feel the angles of the strips they drive, as `ilg_circuit.reflex` returns it.

    Attributes
    ----------
    time : ndarray (t,)
        Times [s].
    outputs : ndarray (t, n)
        Outputs y = max(x, 0) of the neurons.
    unit_outputs : ndarray (t, units)
        Output of the extensor minus that of the flexor, of every unit.
    voltages : ndarray (t, units)
        Voltages on the strips [V].
    angles : ndarray (t, units)
        Angles of the segments [rad].
    inputs : ndarray (t, units)
        Inputs s of the extensors; those of the flexors are -s.
    period : float or None
        Period [s], None without a rhythm.
    rhythm, without : LoopRhythm or None
        Long-term behaviour with the reflex and without it; None for a strip that is not linear.
    loop : Loop
        The network, the strip of a unit, gain and limits.
    engine : str
        What solved the loop: "ode" or "ngspice".
    error : float
        Error of the waves estimated by ngspice, relative to the largest; 0 for "ode".
    warnings : tuple of str
        Findings as sentences.
    """

    presenter: ClassVar[str] = "reflex"

    loop: Loop
    engine: str
    start: Array
    time: Array
    inner: Array
    angles: Array
    rhythm: LoopRhythm | None
    without: LoopRhythm | None
    error: float

    @property
    def outputs(self) -> Array:
        """Outputs of the neurons, y = max(x, 0) (t, n)."""
        return np.maximum(self.inner, 0)

    @property
    def unit_outputs(self) -> Array:
        """Output of the extensor minus that of the flexor, of every unit (t, units)."""
        return self.outputs @ self.loop.network.readout.T

    @property
    def voltages(self) -> Array:
        """Voltages on the strips [V] (t, units)."""
        return self.loop.voltages(self.unit_outputs)

    @property
    def inputs(self) -> Array:
        """Inputs s (t, units)."""
        return self.loop.inputs(self.time, self.angles)

    @property
    def period(self) -> float | None:
        """Period of the rhythm [s]; of a nonlinear strip the last one of the run, if it repeats."""
        if self.rhythm is not None:
            return self.rhythm.period
        wave = self.unit_outputs[:, 0]
        up = np.flatnonzero((wave[:-1] < 0) & (wave[1:] >= 0))
        if len(up) < _PASSES:
            return None
        at = self.time[up] + np.diff(self.time)[up] * wave[up] / (wave[up] - wave[up + 1])
        last, before = np.diff(at)[:-3:-1]
        return float(last) if abs(last / before - 1) < _ALIKE else None

    @property
    def findings(self) -> tuple[Finding, ...]:
        """Findings about the rhythm, and about a run that is too short to show it."""
        if self.rhythm is None:
            return ()
        found, end = list(self.rhythm.findings), float(self.time[-1])
        if self.period is not None and end < self.period:
            found.append(Finding("cpg-no-period", values={"duration": end, "period": self.period}))
        elif self.period is not None and end < self.rhythm.settled + self.period:
            found.append(Finding("cpg-unsettled-cycle", values={"duration": end, "settled": self.rhythm.settled}))
        elif self.rhythm.outcome == "rest" and end < self.rhythm.settled:
            found.append(Finding("cpg-unsettled-rest", values={"duration": end}))
        return tuple(found)

    def write_deck(self, path: str | Path) -> None:
        """Write neurons, strips and feedback as a SPICE deck of the same duration, which ``ngspice -b`` runs.

        Parameters
        ----------
        path : str or Path
            The file to write; it is replaced whole or not at all.

        Raises
        ------
        InputError
            The file cannot be written.
        """
        from .loop_netlist import loop_deck

        write_text(Path(path), loop_deck(self.loop, self.start, float(self.time[-1]), self.provenance))

    def table(self) -> tuple[Column, ...]:
        """Return time, neuron_1.., then output, voltage, angle and input; of a chain with the number of the unit."""
        waves = [("output", "", self.unit_outputs), ("voltage", "V", self.voltages)]
        waves += [("angle", "rad", self.angles), ("input", "", self.inputs)]
        many = self.loop.units > 1
        return (
            Column("time", self.time, "s", over=True),
            *(Column(f"neuron_{k + 1}", y, "") for k, y in enumerate(self.outputs.T)),
            *(
                Column(f"{name}_{k + 1}" if many else name, wave, unit)
                for name, unit, columns in waves
                for k, wave in enumerate(columns.T)
            ),
        )

    def to_dict(self) -> dict[str, Any]:
        """Return outcome, period, amplitudes and lag with the reflex and without it as JSON-ready values."""
        loop = self.loop
        return {
            "outcome": None if self.rhythm is None else self.rhythm.outcome,
            "period_s": self.period,
            **({} if self.rhythm is None else _numbers(self.rhythm)),
            "largest_angle_rad": float(np.abs(self.angles).max()),
            "without_reflex": None
            if self.without is None
            else {
                "outcome": self.without.outcome,
                "period_s": self.without.period,
                **_numbers(self.without),
            },
            "reflex_per_rad": loop.gain,
            "rest_angle_rad": loop.rest_angle,
            "voltage_V": loop.voltage,
            "reference": loop.reference,
            "strip": loop.strip.name,
            "engine": self.engine,
            "estimated_wave_error": self.error,
            "warnings": list(self.warnings),
        }


def _numbers(rhythm: LoopRhythm) -> dict[str, Any]:
    rest = rhythm.rest_angles
    return {
        "amplitudes": plain(rhythm.amplitudes),
        "angle_amplitudes_rad": plain(rhythm.angle_amplitudes),
        "angle_lags_deg": plain(rhythm.lags),
        "rest_angles_rad": None if rest is None else plain(rest),
        "floquet_multiplier": rhythm.multiplier,
        "settled_s": rhythm.settled,
    }


def run_loop(loop: Loop, times: ArrayLike, start: ArrayLike | None = None, *, engine: str = "ode") -> ReflexRun:
    """Return a run of ``loop`` at ``times`` [s], ascending from 0, and its long-term behaviour.

    ``engine`` "ode" is the exact flow, "ngspice" the one netlist of all. Raises InputError for a nonlinear strip with
    "ode", SolveError where ngspice fails.
    """
    if engine not in ENGINES:
        raise wrong_choice("engine", engine, ENGINES)
    samples = np.asarray(times, dtype=float)
    neurons = checked_start(loop.network, start)
    if engine == "ode":
        flow = LoopFlow(loop)
        states = sampled(flow, flow.start(neurons), samples)
        inner, angles, error = states[:, : loop.network.size], flow.angles(states), 0.0
    else:
        from .loop_netlist import loop_by_ngspice

        inner, angles, error = loop_by_ngspice(loop, neurons, samples)
    felt = without = None
    if loop.strip.linear:
        felt = loop_rhythm(loop, neurons)
        without = loop_rhythm(loop.with_gain(0.0), neurons) if loop.gain else felt
    return ReflexRun(loop, engine, neurons, samples, inner, angles, felt, without, error)


@dataclass(frozen=True, repr=False, eq=False)
class ReflexSweep(Result):
    """The rhythm of neurons over the gain of their reflex, as `ilg_circuit.reflex` returns it for a sweep.

    Each value goes on from the rhythm of the one before, or from the start where that was none.

    Attributes
    ----------
    gain : ndarray (n,)
        Gains h [1/rad].
    outcomes : tuple of str
        Long-term behaviour at each gain: "cycle", "rest" or "undecided".
    period : ndarray (n,)
        Periods [s]; NaN without a cycle.
    amplitude : ndarray (n,)
        Half the peak-to-peak of the first unit's output.
    angle : ndarray (n,)
        Half the peak-to-peak of the first unit's angle [rad].
    lag : ndarray (n,)
        Degrees by which the angle lags the output; NaN without a cycle.
    """

    presenter: ClassVar[str] = "reflex_sweep"

    gain: Array
    outcomes: tuple[str, ...]
    period: Array
    amplitude: Array
    angle: Array
    lag: Array

    def to_dict(self) -> dict[str, Any]:
        """Return a row a gain; None where there is no period."""
        numbers = (self.gain, self.period, self.amplitude, self.angle, self.lag)
        keys = ("reflex_per_rad", "period_s", "amplitude", "angle_rad", "angle_lag_deg")
        rows = zip(self.outcomes, *(plain(values) for values in numbers), strict=True)
        return {"rows": [{"outcome": row[0], **dict(zip(keys, row[1:], strict=True))} for row in rows]}

    def table(self) -> tuple[Column, ...]:
        """Return reflex, oscillates (1 or 0), period, amplitude, angle and its lag."""
        flags = [None if outcome == "undecided" else int(outcome == "cycle") for outcome in self.outcomes]
        return (
            Column("reflex", self.gain, "1/rad", over=True),
            Column("oscillates", flags, ""),
            Column("period", self.period, "s"),
            Column("amplitude", self.amplitude, ""),
            Column("angle", self.angle, "rad"),
            Column("angle_lag_deg", self.lag, ""),
        )


def reflex_sweep(
    loop: Loop,
    gains: ArrayLike,
    start: ArrayLike | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> ReflexSweep:
    """Return the rhythm of ``loop`` at ``gains`` h [1/rad] (n,). Raises InputError for too many."""
    values = np.atleast_1d(np.asarray(gains, dtype=float))
    if not 1 <= values.size <= MOST_VALUES or values.ndim != 1:
        raise InputError(f"{argument('sweep')} takes 1 to {MOST_VALUES} values, not {values.size}")
    neurons = checked_start(loop.network, start)
    rhythms: list[LoopRhythm] = []
    for k, gain in enumerate(values.tolist()):
        before = rhythms[-1] if rhythms and rhythms[-1].outcome == "cycle" else None
        rhythms.append(loop_rhythm(loop.with_gain(gain), neurons, before))
        if progress:
            progress(k + 1, len(values))
    rows = [
        (np.nan if r.period is None else r.period, r.amplitudes[0], r.angle_amplitudes[0], r.lags[0]) for r in rhythms
    ]
    return ReflexSweep(values, tuple(r.outcome for r in rhythms), *np.array(rows).T)
