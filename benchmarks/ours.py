"""The same tasks by ilg_circuit. Times run from parameters to samples: netlists are made within them."""

from __future__ import annotations

from collections.abc import Callable
from time import perf_counter

import numpy as np
from cases import ACCURACY, DRIVE, TIMES, Array, case, record
from memory import growth

from ilg_circuit.fit.result import FitResult
from ilg_circuit.identification.current import CurrentData
from ilg_circuit.measurements.prepare import prepare
from ilg_circuit.measurements.table import Table
from ilg_circuit.solve import transient
from ilg_circuit.strip.models import electrical_model


def solve(name: str, count: int) -> Array:
    """Outputs (count, outputs, samples) of the first ``count`` sets, at the accuracy asked for."""
    chosen = case(name)
    netlists = [chosen.netlist(factors) for factors in chosen.sets[:count]]
    waves = transient(netlists, DRIVE, TIMES, accuracy=ACCURACY)
    return waves.values[:, [waves.names.index(output) for output in chosen.outputs]]


def time_solve(name: str, count: int, repeats: int) -> list[float]:
    """Seconds a set, one figure a repeat."""
    return [_timed(lambda: solve(name, count)) / count for _ in range(repeats)]


def error(name: str, count: int) -> float:
    """Largest error over the first ``count`` sets, against the exact engine."""
    values = solve(name, count)
    return max(case(name).error(values[k], k) for k in range(count))


def time_fit(repeats: int) -> tuple[list[float], Array, Array, int]:
    """Seconds a fit, from the table on; values and standard errors of Rdc, Rd, C; and circuits solved."""
    fit = _fit()
    seconds = [_timed(_fit) for _ in range(repeats)]
    return seconds, fit.values, fit.errors, fit.evaluations * (2 * len(fit.values) + 1)


def memory_growth(runs: int) -> float:
    """Growth [MB] over ``runs`` runs of the small circuit."""
    netlist, times = case("rc").netlists[0], np.linspace(0.0, TIMES[-1], 61)
    return growth(lambda: transient(netlist, DRIVE, times, accuracy=ACCURACY), runs)


def _fit() -> FitResult:
    times, current = record()
    table = Table({"time": times, "voltage": np.full(len(times), 4.0), "current": current})
    measured = prepare(table)
    return CurrentData(measured, "ngspice", measured.source).individual(electrical_model("rc"), 0.0, None).fit


def _timed(task: Callable[[], object]) -> float:
    start = perf_counter()
    task()
    return perf_counter() - start
