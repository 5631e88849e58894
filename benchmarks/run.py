"""Measure ilg_circuit beside the plain way in one run; prints a table and writes it to RESULTS.md.

Each way has a process of its own, because ngspice's library can serve one interface a process. Their repeats take
turns, so that a busy moment of the machine meets both.
"""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from time import perf_counter
from typing import ParamSpec, TypeVar

import cold_start
import numpy as np
import ours
import plain
from cases import BATCH, NOISE, SPREAD
from figure import Figure
from machine import conditions, load

RESULTS = Path(__file__).with_name("RESULTS.md")
PACKAGES = ("ilg-circuit", "PySpice", "numpy", "scipy", "lmfit")
TITLES = {"rc": "rc circuit", "strip": "full dynamic strip"}

ROUNDS = 5
SINGLE_REPEATS = 15
FIT_REPEATS = 5
#: Sets of the batch that are timed with the halved step, which takes long.
HALVED_SETS = 10
OUR_RUNS, PLAIN_RUNS = 10_000, 500

P = ParamSpec("P")
T = TypeVar("T")


@dataclass(frozen=True)
class Row:
    """One line of the table: the plain way's figures with the step halved and best tuned, and ours.

    A ratio is the plain way's figure over ours.
    """

    what: str
    halved: str
    tuned: str
    ours: str
    ratios: tuple[str, str] = ("", "")


@dataclass(frozen=True)
class Report:
    """Lines of the table and the notes below it."""

    rows: list[Row]
    notes: list[str]


class Way:
    """A fresh process that works through calls, one after the other."""

    def __init__(self) -> None:
        self._pool = ProcessPoolExecutor(1, multiprocessing.get_context("spawn"))

    def __call__(self, function: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> T:
        return self._pool.submit(function, *args, **kwargs).result()

    def close(self) -> None:
        self._pool.shutdown()


@contextmanager
def two_ways() -> Iterator[tuple[Way, Way]]:
    """Processes for the plain way and for ours."""
    ways = (Way(), Way())
    try:
        yield ways
    finally:
        for way in ways:
            way.close()


def compare_solves(report: Report, name: str) -> tuple[plain.Choice, plain.Choice]:
    """Time a parameter set, alone and in a batch; returns the plain way's choices for one set: halved, tuned."""
    with two_ways() as (theirs, mine):
        halved, alone = theirs(plain.halve, name, HALVED_SETS), theirs(plain.search, name, 1)
        report.notes.append(f"Halved, {TITLES[name]}: {halved.options}.")
        for count, repeats in ((1, SINGLE_REPEATS), (BATCH, 1)):
            tuned = alone if count == 1 else theirs(plain.search, name, count)
            error = mine(ours.error, name, count)
            slowest, slow, fast = [], [], []
            for _ in range(ROUNDS):
                slowest += theirs(plain.time_solve, name, min(count, HALVED_SETS), 1, halved.options)
                slow += theirs(plain.time_solve, name, count, repeats, tuned.options)
                fast += mine(ours.time_solve, name, count, repeats)
            times = (median(slowest), median(slow), median(fast))
            how = "one set alone" if count == 1 else f"a set in a batch of {count}"
            cells = [
                f"{1e3 * time:.{digits}f} ms (error {e:.1e})"
                for time, digits, e in zip(times, (1, 2, 3), (halved.error, tuned.error, error), strict=True)
            ]
            report.rows.append(Row(f"{TITLES[name]}, {how}", *cells, ratios=_ratios(times)))
            report.notes.append(f"Best tuned, {TITLES[name]}, {how}: {tuned.options}.")
    return halved, alone


def compare_fits(report: Report, choices: tuple[plain.Choice, plain.Choice]) -> None:
    """Time a three-parameter fit; raises SystemExit where the answers differ."""
    halved, tuned = choices
    slowest, slow, fast = [], [], []
    with two_ways() as (theirs, mine):
        seconds, halved_answer, halved_calls = theirs(plain.time_fit, 1, halved.options)
        slowest += seconds
        for _ in range(ROUNDS):
            seconds, expected, calls = theirs(plain.time_fit, FIT_REPEATS, tuned.options)
            slow += seconds
            seconds, values, errors, circuits = mine(ours.time_fit, FIT_REPEATS)
            fast += seconds
    apart = max(float((np.abs(values - other) / errors).max()) for other in (expected, halved_answer))
    if not apart <= 0.1:
        raise SystemExit(f"the fits differ by {apart:.2g} standard errors; their times mean nothing")
    times = (median(slowest), median(slow), median(fast))
    cells = [
        f"{1e3 * time:.1f} ms ({count} circuits)"
        for time, count in zip(times, (halved_calls, calls, circuits), strict=True)
    ]
    report.rows.append(Row("fit of Rdc, Rd, C to 600 samples", *cells, ratios=_ratios(times)))
    answers = "; ".join(
        f"{symbol} {x:.6g} and {y:.6g} {unit} (standard error {e:.2g})"
        for symbol, unit, x, y, e in zip(("Rdc", "Rd", "C"), ("ohm", "ohm", "F"), expected, values, errors, strict=True)
    )
    report.notes.append(f"Fits, best tuned and ilg_circuit: {answers}; all at most {apart:.1g} standard errors apart.")


def _ratios(times: tuple[float, float, float]) -> tuple[str, str]:
    """The plain way's two times over ours."""
    halved, tuned, fast = times
    return _two_figures(halved / fast), _two_figures(tuned / fast)


def _two_figures(ratio: float) -> str:
    return f"{ratio:.0f}" if ratio >= 10 else f"{ratio:.1f}"


def compare_memory(report: Report, options: plain.Options) -> None:
    """Growth of resident memory over many runs."""
    with two_ways() as (theirs, mine):
        a = theirs(plain.memory_growth, PLAIN_RUNS, options) * OUR_RUNS / PLAIN_RUNS
        b = mine(ours.memory_growth, OUR_RUNS)
    report.rows.append(Row(f"memory growth over {OUR_RUNS:,} runs, rc circuit", "", f"{a:.0f} MB", f"{b:.1f} MB"))
    report.notes.append(f"Memory of the plain way: {PLAIN_RUNS} runs, scaled to {OUR_RUNS:,}.")


def measure_cold_start(report: Report) -> None:
    """The command line, from nothing."""
    report.rows.append(Row("`ilg-circuit --help`", "", "", f"{cold_start.time_help():.2f} s"))
    command = "`ilg-circuit simulate paper --drive step:4V --duration 300s --out ...`"
    report.rows.append(Row(command, "", "", f"{cold_start.time_simulate():.2f} s"))


def heading() -> list[str]:
    """Versions, machine and date."""
    with two_ways() as (_, mine):
        ngspice = mine(ngspice_version)
    return conditions(PACKAGES, f"ngspice {ngspice}")


def ngspice_version() -> str:
    """Version of the ngspice that is measured."""
    from ilg_circuit.solve.ngspice import session

    return session().version


def markdown(report: Report, heading: list[str]) -> str:
    """The page: conditions, table, notes."""
    lines = ["# Benchmark results", "", "Written by `make bench`.", "", *heading, ""]
    lines += [
        "| | plain, step halved | plain, best tuned | ilg_circuit | halved / ours | tuned / ours |",
        "|---|---|---|---|---|---|",
    ]
    for r in report.rows:
        cells = (r.halved, r.tuned, r.ours, *r.ratios)
        lines.append(f"| {r.what} | {' | '.join(cell or '–' for cell in cells)} |")
    return "\n".join([*lines, "", *(f"- {note}" for note in report.notes), ""])


def main() -> list[Figure]:
    """Measure everything, print and write the table."""
    start = perf_counter()
    conditions_now = heading()
    report = Report(
        [],
        [
            "Drive: 4 V step, 300 s, 601 samples. Errors are relative to each output's maximum, against the exact "
            "engine: current and charge of the rc circuit, current and displacement of the strip. Medians.",
            f"Batch: Rdc, Rd and C of {BATCH} sets within {SPREAD:.0%} of the paper's; the error is the worst of them.",
            "ilg_circuit was told `accuracy=1e-6` and nothing else; its times begin with the parameters, the making of "
            "netlists included.",
            "Plain PySpice is its high-level call in a loop; the making of its netlists and the removal of its "
            "circuits from ngspice are not counted.",
            "Step halved: ngspice's own tolerances, and the time step halved until two answers agree to 1e-6: what "
            f"a user can do who does not know the exact answer. In the batch {HALVED_SETS} sets are timed; the halving "
            "itself is not counted.",
            f"Best tuned: the fastest of {len(plain.CANDIDATES)} sets of options that reach 1e-6 on the sets measured, "
            "found with the exact answer at hand; that search is not counted.",
            f"Fit: noise of {NOISE:.1%} of the peak current; plain start values 20% off, ilg_circuit finds its own.",
        ],
    )
    choices = {name: compare_solves(report, name) for name in TITLES}
    compare_fits(report, choices["rc"])
    compare_memory(report, choices["rc"][1].options)
    measure_cold_start(report)
    report.notes.append(f"Whole run: {perf_counter() - start:.0f} s{load('at the end')}.")
    page = markdown(report, conditions_now)
    RESULTS.write_text(page, encoding="utf-8")
    print(page)
    return [
        Figure(r.what, r.ours, f"PySpice: {r.halved}, {r.ratios[0]} times; best tuned {r.tuned}, {r.ratios[1]} times")
        if r.ratios[0]
        else Figure(r.what, r.ours, r.tuned and f"PySpice: {r.tuned}")
        for r in report.rows
    ]


if __name__ == "__main__":
    main()
