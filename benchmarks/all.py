"""`make bench`: every page of results, and every figure that the documentation states, measured again in one run.

Writes FIGURES.md, one table of all. Each script has a process of its own, one after the other. The coverage of
intervals takes most of an hour: `--sets 0` leaves it out, another number makes it so many data sets a model.

python benchmarks/all.py [--sets 500]
"""

from __future__ import annotations

import argparse
import importlib
import multiprocessing
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from time import perf_counter

from figure import Figure
from machine import conditions

RESULTS = Path(__file__).with_name("FIGURES.md")
#: Script -> where the details are.
PAGES = {
    "accuracy": "",
    "reading": "",
    "identify_cost": "",
    "stated_error": "STATED_ERROR.md",
    "run": "RESULTS.md",
    "spectra": "SPECTRA.md",
    "arm": "ARM.md",
    "shape_coverage": "SHAPE.md",
    "couplings": "COUPLINGS.md",
    "bands": "BANDS.md",
    "sweep": "SWEEP.md",
    "line": "LINE.md",
    "control": "CONTROL.md",
    "design": "DESIGN.md",
    "papers": "PAPERS.md",
    "outliers": "OUTLIERS.md",
    "intervals": "INTERVALS.md",
}


def measure(script: str, arguments: list[str]) -> list[Figure]:
    """In a process of its own: the figures that a script finds, once it has written its page."""
    sys.argv = [f"{script}.py", *arguments]
    figures: list[Figure] = importlib.import_module(script).main()
    return figures


def main() -> None:
    """Run all, write the table; scripts that fail are told at the end."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sets", type=int, default=500, help="noisy data sets a model for the coverage of intervals")
    sets = parser.parse_args().sets
    lines, failures, begin = [], [], perf_counter()
    for script, page in PAGES.items():
        arguments = (
            [str(sets), "spectrum", "step:rc", "step:rc2", "step:rc3", "autocorrelated, onset stated", "--again"]
            if script == "intervals"
            else ["--again"] * (script in ("couplings", "bands"))
        )
        if script == "intervals" and not sets:
            continue
        print(f"== {script} ({perf_counter() - begin:.0f} s so far)", flush=True)
        with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as fresh:
            try:
                figures = fresh.submit(measure, script, arguments).result()
            except (Exception, SystemExit) as error:  # whatever one script ends in, the others are measured
                failures.append(f"{script}.py: {error}")
                continue
        lines += [figure.row(page or f"{script}.py") for figure in figures]
    head = ["# Every figure, measured in one run", "", "Written by `make bench`.", ""]
    head += [*conditions(("ilg-circuit", "PySpice", "numpy", "scipy", "lmfit")), ""]
    head += ["| stated, or what | measured | others, in the same run | page or script |", "|---|---|---|---|"]
    RESULTS.write_text("\n".join([*head, *lines, "", *(f"- failed: {f}" for f in failures)]) + "\n", encoding="utf-8")
    print(RESULTS.read_text(encoding="utf-8"))
    if failures:
        raise SystemExit("; ".join(failures))


if __name__ == "__main__":
    main()
