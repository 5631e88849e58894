"""The plain way: PySpice's own call in a loop, a cubic spline onto the samples, for a fit lmfit around it.

It is measured twice. "Halved": ngspice's own tolerances, and the time step halved until two answers agree to the
accuracy, which is what a user can do who wants to know the error. "Best tuned": options from a search that knows the
exact answer, the fastest of those that reach the accuracy, where a user would have to guess. Its circuits are those of
ilg_circuit's netlists, whose making is not counted outside the fit. ngspice's Gear method and saving fewer vectors were
tried too and make it no faster.
PySpice destroys the plot before each run; circuits pile up, because its call never removes them.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import product
from statistics import median
from time import perf_counter
from typing import Any

import lmfit
import numpy as np
from cases import ACCURACY, DRIVE, TIMES, Array, case, nominal_parameters, record
from memory import growth
from scipy.interpolate import CubicSpline

from ilg_circuit.circuit import Netlist, electrical_netlist
from ilg_circuit.solve.library import prepare_library

#: Each start value of the fit is this factor off.
_START = np.array([1.2, 0.8, 1.2])
_SHORTLIST = 6
_MOST_HALVINGS = 12


@dataclass(frozen=True)
class Options:
    """What PySpice's ``simulator.options(...)`` and ``.transient(...)`` are given; times in seconds."""

    reltol: float
    trtol: float
    abstol: float
    chgtol: float
    step_time: float
    max_time: float

    def __str__(self) -> str:
        return ", ".join(f"{name}={value:g}" for name, value in vars(self).items())


#: What ngspice takes when nothing is said, at one step a sample.
DEFAULTS = Options(reltol=1e-3, trtol=7.0, abstol=1e-12, chgtol=1e-14, step_time=0.5, max_time=0.5)

CANDIDATES = tuple(
    Options(reltol, trtol, abstol, chgtol, 1e-2, longest)
    for reltol, trtol, (abstol, chgtol), longest in product(
        (1e-6, 1e-7, 1e-8, 1e-9),
        (7.0, 3.0, 1.0, 0.5, 0.2, 0.1, 0.05, 0.02, 0.01),
        ((1e-6, 1e-6), (1e-9, 1e-6), (1e-12, 1e-14)),
        (5.0, 30.0),
    )
)


@dataclass(frozen=True)
class Choice:
    """Options and the largest error that they leave."""

    options: Options
    error: float


def solve(netlist: Netlist, outputs: tuple[str, ...], times: Array, options: Options) -> Array:
    """Outputs (outputs, samples) of one circuit at ``times`` [s]."""
    circuit = netlist.to_pyspice(DRIVE, float(times[-1]))
    simulator = circuit.simulator(simulator="ngspice-shared", ngspice_shared=_shared())
    simulator.options(reltol=options.reltol, trtol=options.trtol, abstol=options.abstol, chgtol=options.chgtol)
    analysis = simulator.transient(
        step_time=options.step_time, end_time=float(times[-1]), max_time=options.max_time, use_initial_condition=True
    )
    time = np.array(analysis.time)
    keep = np.append(True, np.diff(time) > 1e-12 * time[-1])
    terms = {output.name: output.terms for output in netlist.outputs}
    waves = [sum(c * np.array(analysis[q[2:-1].lower()]) for q, c in terms[name]) for name in outputs]
    return np.array([CubicSpline(time[keep], np.asarray(wave)[keep])(times) for wave in waves])


def search(name: str, count: int) -> Choice:
    """The fastest candidate that reaches the accuracy on the first ``count`` sets, or the closest where none does."""
    tried = [(_attempt(name, options), options) for options in CANDIDATES]
    reaching = [(seconds, options) for (seconds, error), options in tried if error <= ACCURACY]
    shortlist = sorted(reaching, key=lambda pair: pair[0])
    first = [(median(time_solve(name, 1, 9, options)), options) for _, options in shortlist[:_SHORTLIST]]
    for _, options in [*sorted(first, key=lambda pair: pair[0]), *shortlist[_SHORTLIST:]]:
        error = worst_error(name, count, options)
        if error <= ACCURACY:
            return Choice(options, error)
    closest = min(tried, key=lambda pair: pair[0][1])[1]
    return Choice(closest, worst_error(name, count, closest, stop=False))


def halve(name: str, count: int) -> Choice:
    """Halve the step until the nominal set's answer moves by less than the accuracy; the error is over ``count``."""
    chosen = case(name)
    options = DEFAULTS
    finer = solve(chosen.netlists[0], chosen.outputs, TIMES, options)
    for _ in range(_MOST_HALVINGS):
        coarser, step = finer, options.max_time / 2
        options = replace(options, step_time=step, max_time=step)
        finer = solve(chosen.netlists[0], chosen.outputs, TIMES, options)
        moved = np.abs(finer - coarser).max(axis=1) / np.abs(finer).max(axis=1)
        if (moved <= ACCURACY).all():
            return Choice(options, worst_error(name, count, options, stop=False))
    raise RuntimeError(f"the step of {name} was halved {_MOST_HALVINGS} times and its answer does not settle")


def time_solve(name: str, count: int, repeats: int, options: Options) -> list[float]:
    """Seconds a set, one figure a repeat; each is a loop over the first ``count`` sets."""
    chosen = case(name)
    seconds = []
    for _ in range(repeats):
        start = perf_counter()
        for netlist in chosen.netlists[:count]:
            solve(netlist, chosen.outputs, TIMES, options)
        seconds.append((perf_counter() - start) / count)
    return seconds


def worst_error(name: str, count: int, options: Options, *, stop: bool = True) -> float:
    """Largest error over the first ``count`` sets; with ``stop``, the first that is too large."""
    chosen, worst = case(name), 0.0
    for k, netlist in enumerate(chosen.netlists[:count]):
        worst = max(worst, chosen.error(solve(netlist, chosen.outputs, TIMES, options), k))
        if stop and worst > ACCURACY:
            break
    return worst


def time_fit(repeats: int, options: Options) -> tuple[list[float], Array, int]:
    """Seconds a fit; fitted Rdc, Rd, C; and circuits solved."""
    times, current = record()
    scale = float(np.abs(current).max())

    def residual(parameters: lmfit.Parameters) -> Array:
        dc, dynamic, capacitance = np.exp([p.value for p in parameters.values()]).tolist()
        netlist = electrical_netlist(dc, ((dynamic, capacitance),))
        return np.asarray((solve(netlist, ("current",), times, options)[0] - current) / scale)

    def fit() -> Any:
        parameters = lmfit.Parameters()
        for symbol, value in zip(("Rdc", "Rd", "C"), np.log(nominal_parameters() * _START), strict=True):
            parameters.add(symbol, value=float(value))
        return lmfit.minimize(residual, parameters, method="leastsq")

    result = fit()
    seconds = []
    for _ in range(repeats):
        start = perf_counter()
        fit()
        seconds.append(perf_counter() - start)
    return seconds, np.exp([p.value for p in result.params.values()]), int(result.nfev)


def memory_growth(runs: int, options: Options) -> float:
    """Growth [MB] over ``runs`` runs of the small circuit."""
    netlist, times = case("rc").netlists[0], np.linspace(0.0, TIMES[-1], 61)
    return growth(lambda: solve(netlist, ("current", "charge"), times, options), runs)


def _attempt(name: str, options: Options) -> tuple[float, float]:
    """Seconds and error of the nominal set; without limit where ngspice gives up."""
    chosen = case(name)
    start = perf_counter()
    try:
        values = solve(chosen.netlists[0], chosen.outputs, TIMES, options)
    except (NameError, ValueError, KeyError, IndexError):  # PySpice's ways to say that the run failed
        return np.inf, np.inf
    return perf_counter() - start, chosen.error(values)


@lru_cache
def _shared() -> Any:
    """PySpice's interface to ngspice, as it is but for one thing: it takes the notes of recent versions for errors."""
    prepare_library()
    logging.getLogger("PySpice").setLevel(logging.ERROR)
    from PySpice.Spice.NgSpice.Shared import NgSpiceCommandError, NgSpiceShared  # untyped: Any to mypy

    class Shared(NgSpiceShared):  # type: ignore[misc]
        def exec_command(self, command: str, join_lines: bool = True) -> Any:
            try:
                return super().exec_command(command, join_lines)
            except NgSpiceCommandError:
                return self.stdout if join_lines else self._stdout

    return Shared()
