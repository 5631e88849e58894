"""Writes tests/slow.txt: the tests that `make test` leaves to `make test-slow`, by how long they took in a run of all.

A test function is slow if its cases take ``--mean`` seconds each or more, with what is set up for them. Where the first
function is left out the next one has to set it up: a run with ``-m "not slow"`` then shows ``--more``. The list is made
anew when the tests that are not on it no longer end within 8 minutes on two processors.

usage: python -m pytest -n 2 --dist loadfile --durations 0 --durations-min 0.02 > run.txt
       python scripts/slow_tests.py run.txt [--mean 1.1] [--more]
"""

from __future__ import annotations

import argparse
import re
from collections import defaultdict
from pathlib import Path

LIST = Path(__file__).resolve().parents[1] / "tests" / "slow.txt"
#: A line of pytest's table of durations.
_LINE = re.compile(r"\s*([\d.]+)s (?:call|setup|teardown)\s+(tests/\S+::.+)")


def slow(report: str, mean: float) -> list[str]:
    """Return the functions, as file::name, whose cases take ``mean`` seconds each or more in pytest's report."""
    cases: defaultdict[str, float] = defaultdict(float)
    for line in report.splitlines():
        if found := _LINE.match(line):
            cases[found[2].strip()] += float(found[1])
    functions = defaultdict(list)
    for case, seconds in cases.items():
        functions[case.partition("[")[0]].append(seconds)
    return sorted(name for name, each in functions.items() if sum(each) / len(each) >= mean)


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("report", type=Path)
    options.add_argument("--more", action="store_true", help="keep those that are on the list, of a run without them")
    options.add_argument("--mean", type=float, default=1.1, help="seconds a case")
    given = options.parse_args()
    found = slow(given.report.read_text(encoding="utf-8"), given.mean)
    if given.more:
        found = sorted({*found, *LIST.read_text(encoding="utf-8").split()})
    LIST.write_text("".join(f"{name}\n" for name in found), encoding="utf-8")
    print(f"{len(found)} functions in {LIST}")


if __name__ == "__main__":
    main()
