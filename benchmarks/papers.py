"""Both papers remade from nothing: how long `ilg-circuit reproduce` takes, and what it finds.

Prints a table and writes it to PAPERS.md; fails where an item does, or beyond five minutes.

python benchmarks/papers.py
"""

from __future__ import annotations

import json
import subprocess
import tempfile
from pathlib import Path
from time import perf_counter
from typing import Any

from cold_start import command
from figure import Figure
from machine import conditions

RESULTS = Path(__file__).with_name("PAPERS.md")
PACKAGES = ("ilg-circuit", "PySpice", "numpy", "lmfit", "numba")
LIMIT = 300.0


def measure() -> tuple[float, int, dict[str, Any]]:
    """Seconds of the whole command, its exit code, and its reproduce.json."""
    with tempfile.TemporaryDirectory() as folder:
        start = perf_counter()
        code = subprocess.run([command(), "reproduce", folder], capture_output=True).returncode
        seconds = perf_counter() - start
        return seconds, code, json.loads((Path(folder) / "reproduce.json").read_text(encoding="utf-8"))


def markdown(seconds: float, found: dict[str, Any]) -> str:
    """The page of results."""
    count = found["count"]
    lines = ["# Both papers, remade", "", "Written by `python benchmarks/papers.py`.", "", *conditions(PACKAGES), ""]
    lines += [
        f"{len(found['items'])} items in {seconds:.0f} s: {count['agrees']} agree, in {count['differs']} the paper "
        f"differs from what its equations recompute to or claims what does not hold, {count['fails']} fail.",
        "",
        "| item | | s | outcome | agreement |",
        "|---|---|---|---|---|",
    ]
    for item in found["items"]:
        cells = (item["id"], item["title"], f"{item['seconds']:.1f}", item["light"], item["agreement"])
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def main() -> list[Figure]:
    """Measure, print and write."""
    seconds, code, found = measure()
    page = markdown(seconds, found)
    RESULTS.write_text(page, encoding="utf-8")
    print(page)
    if code:
        raise SystemExit("an item fails")
    if seconds > LIMIT:
        raise SystemExit(f"slower than {LIMIT:.0f} s")
    count = found["count"]
    told = (
        f"{seconds:.0f} s: {count['agrees']} agree, {count['differs']} where the paper differs, {count['fails']} fail"
    )
    return [Figure(f"both papers remade, {len(found['items'])} items", told)]


if __name__ == "__main__":
    main()
