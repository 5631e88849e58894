"""A network's run as a table, a CSV file, JSON and pictures."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Array
from ..errors import InputError
from ..files import write_text
from ..simulation.response import sample_times
from .flow import Flow, sampled
from .network import Network, checked_start
from .outcome import Rhythm
from .rhythm import rhythm
from .symmetry import quotient

ENGINES = ("ode", "ngspice")
#: Samples in the shorter of the two time constants, unless asked for otherwise; and how many at most.
_SAMPLES_PER_CONSTANT = 100
_MOST_DEFAULT_SAMPLES = 100_000


@dataclass(frozen=True)
class Run:
    """A network from ``start`` at ``time`` [s] (t,): ``states`` (t, 2 n) = (x, v), NaN for v from ngspice.

    ``rhythm`` is what it does in the end. ``period`` [s] and ``amplitude`` are its, or those that ngspice's waves
    show; ``error`` is ngspice's estimated relative error of both, ``wave_error`` that of x over time (0 for ode).
    ``warnings`` are for the user.
    """

    network: Network
    engine: str
    time: Array
    states: Array
    rhythm: Rhythm
    period: float | None
    amplitude: float
    error: float
    wave_error: float
    warnings: tuple[str, ...]

    @property
    def outputs(self) -> Array:
        """y (t, n)."""
        return np.maximum(self.states[:, : self.network.size], 0)

    @property
    def unit_outputs(self) -> Array:
        """y_extensor - y_flexor of every unit (t, units)."""
        return np.asarray(self.outputs @ self.network.readout.T)

    def write_csv(self, path: str | Path) -> None:
        """Write time_s, neuron_1.., output (y_1 - y_2), and for a chain unit_1..; with full precision."""
        names = ["time_s", *(f"neuron_{k + 1}" for k in range(self.network.size)), "output"]
        columns = [self.time, *self.outputs.T, self.unit_outputs[:, 0]]
        if len(self.network.units) > 1:
            names += [f"unit_{k + 1}" for k in range(len(self.network.units))]
            columns += list(self.unit_outputs.T)
        rows = [",".join(names), *(",".join(map(repr, row)) for row in np.column_stack(columns).tolist())]
        write_text(Path(path), "\n".join(rows) + "\n")


def default_times(network: Network, duration: float) -> Array:
    """Times from 0 to ``duration`` [s], a round step apart, a hundred or more in the shorter time constant, but no more
    than a hundred thousand."""
    if not (np.isfinite(duration) and duration > 0):
        raise InputError(f"duration {duration:g} s must be more than zero")
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
    progress: Callable[[float], None] | None = None,
) -> Run:
    """Run ``network`` at ``times`` [s], ascending from >= 0, and tell what it does in the end.

    ``engine`` "ode" is the exact flow, "ngspice" the netlist. ``progress(time)`` is called as the former goes on.
    """
    samples = np.asarray(times, dtype=float)
    if samples.ndim != 1 or not len(samples) or not np.isfinite(samples).all() or samples[0] < 0:
        raise InputError("the times of a run must be finite and not negative")
    if (np.diff(samples) <= 0).any():
        raise InputError("the times of a run must ascend")
    if not samples[-1] > 0:
        raise InputError(f"duration {samples[-1]:g} s must be more than zero")
    if engine not in ENGINES:
        raise InputError(f"engine is '{engine}'; choose {' or '.join(ENGINES)}")
    state = checked_start(network, start)
    end = rhythm(network, state)
    period, amplitude, error, wave_error = end.period, end.amplitude, 0.0, 0.0
    if engine == "ode":
        alike = quotient(network, state)
        states = alike.unfolded(sampled(Flow(alike.network), alike.folded(state), samples, progress))
    else:
        from .netlist import measured, sampled_by_ngspice

        inner, wave_error = sampled_by_ngspice(network, samples, state)
        states = np.hstack([inner, np.full_like(inner, np.nan)])
        if end.cycle is not None:
            found = measured(end)
            period, amplitude, error = found.period, found.amplitude, found.error
    warnings = (*end.warnings, *_about_duration(end, float(samples[-1])))
    return Run(network, engine, samples, states, end, period, amplitude, error, wave_error, warnings)


def _about_duration(end: Rhythm, duration: float) -> tuple[str, ...]:
    if end.period is not None and duration < end.period:
        return (
            f"the duration {duration:.4g} s is too short to show one period, {end.period:.4g} s; period and amplitude "
            "are those of the cycle that is reached later",
        )
    if end.period is not None and duration < end.settled + end.period:
        return (
            f"the duration {duration:.4g} s ends before the motion has settled; period and amplitude are those of the "
            f"cycle that is reached after about {end.settled:.3g} s",
        )
    if end.outcome == "rest" and duration < end.settled:
        return (f"the duration {duration:.4g} s ends before the motion has settled; it comes to rest later",)
    return ()


def describe(result: Run) -> dict[str, Any]:
    """What ``--json`` prints; None for what there is not."""
    end, network = result.rhythm, result.network
    described: dict[str, Any] = {
        "oscillates": end.oscillates,
        "period_s": result.period,
        "amplitude": result.amplitude,
        "frequency_Hz": 1 / result.period if result.period else None,
        "outcome": end.outcome,
        "reason": end.reason,
        "phase_lags_deg": _plain(end.phase_lags),
        "engine": result.engine,
        "estimated_error": result.error,
        "estimated_wave_error": result.wave_error,
        "floquet_multiplier": end.cycle.multiplier if end.cycle else None,
        "settled_s": end.settled,
        "rest_outputs": _plain(np.maximum(end.rest[: network.size], 0)) if end.rest is not None else None,
        "rest_states": [
            {"active": list(s.active), "stable": s.stable, "growth_per_s": s.growth} for s in end.rest_states.states
        ],
        "rest_states_complete": end.rest_states.complete,
        "rest_states_found_by": end.rest_states.how,
        "warnings": list(result.warnings),
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
        described["unit_lags_deg"] = _plain(end.unit_lags)
        described["unit_amplitudes"] = _plain(end.swing)
    return described


def _plain(values: Array) -> list[float | None]:
    return [None if math.isnan(v) else v for v in values.tolist()]


def tabulate(result: Run) -> str:
    """The same for people."""
    end, network = result.rhythm, result.network
    says = {True: "yes", False: "no", None: "not decided"}[end.oscillates]
    lines = [f"{network.size} neurons, {result.time[-1]:g} s, engine {result.engine}"]
    lines.append(f"oscillates    {says}: {end.reason}")
    if result.period is not None:
        lines.append(f"period        {result.period:.7g} s ({1 / result.period:.5g} Hz)")
    lines.append(f"amplitude     {result.amplitude:.7g} (half the peak-to-peak of y_1 - y_2)")
    if end.cycle is not None and len(network.units) == 1:
        lags = ", ".join("silent" if math.isnan(v) else f"{v:.2f}" for v in end.phase_lags.tolist())
        lines.append(f"phase lags    {lags} degrees behind the first neuron")
    elif end.cycle is not None:
        lags = ", ".join(f"{v:.2f}" for v in end.unit_lags[1:].tolist())
        lines.append(f"unit lags     {lags} degrees behind the unit before")
    if end.rest is not None:
        outputs = ", ".join(f"{v:.5g}" for v in np.maximum(end.rest[: network.size], 0).tolist())
        lines.append(f"rests at      y = {outputs}")
    if result.engine == "ngspice":
        lines.append(f"solved by ngspice, estimated error {result.wave_error:.1e} of the waves")
        if result.period is not None:
            lines[-1] += f", {result.error:.1e} of period and amplitude"
    states = end.rest_states
    kinds = f"{len(states.states)}, {len(states.stable)} of them stable"
    lines.append(f"states of rest {kinds} ({states.how})")
    return "\n".join(lines)
