"""Are readings named as outliers that are none, and are spikes named? Noisy currents of known strips tell.

python benchmarks/outliers.py [clean sets of each kind, default 200]     writes OUTLIERS.md

Sets are those of `intervals.py`: an onset anywhere between two readings, an offset, a level at rest. The command judges
by a model of two branches, whatever model is asked for; that one too simple names nothing is tried by itself. A spike
is one reading, off by 5 % of the peak to either side; three of them stand anywhere in a record.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from figure import Figure
from sets import (
    FRACTIONS,
    REST_LEVELS,
    RESTING,
    SAMPLES,
    SPACING,
    STEP,
    STEPS,
    Case,
    Clock,
    current_table,
    random_of,
)
from tqdm import tqdm

from ilg_circuit.drive import PiecewiseLinear
from ilg_circuit.identification.current import CurrentData
from ilg_circuit.identification.outliers import named_by, without_outliers
from ilg_circuit.measurements.prepare import prepare
from ilg_circuit.measurements.table import Table
from ilg_circuit.strip.models import electrical_model

OUT = Path(__file__).with_name("OUTLIERS.md")
#: Noise of the clean sets and of those with spikes, over the peak.
CLEAN_NOISE, SPIKED_NOISE = (0.001, 0.005, 0.01), (0.001, 0.003, 0.005)
SPIKES, SPIKE, LEAST_NAMED = 3, 0.05, 0.95


def table_of(model: str, noise: float, label: str, k: int) -> tuple[Table, np.random.Generator]:
    """Set ``k``: a step of the strip of that model, and the generator that goes on from there."""
    random = random_of(label, k)
    case = STEPS[model]
    volts = replace(PiecewiseLinear.step(STEP), rest=float(random.choice(REST_LEVELS)))
    clock = Clock.of(SAMPLES, RESTING, SPACING, FRACTIONS[k % len(FRACTIONS)])
    port = electrical_model(model).port(case.values, case.held)
    return current_table(port, clock, volts, noise, random), random


def _data(table: Table) -> CurrentData:
    return CurrentData(prepare(table), "exact", table.source)


def named_in(table: Table, case: Case) -> tuple[int, ...]:
    """The rows that an identification leaves out."""
    return without_outliers(_data(table), case.held)[0].left_out


def false_rows(strip: str, noise: float, judge: str, count: int, *, quiet: bool = False) -> int:
    """Rows of ``count`` clean sets that are named: by the command, or by the residuals of the model ``judge`` alone."""
    case, label, wrong = STEPS[strip], f"clean:{strip}, {noise:g}", 0
    for k in tqdm(range(count), leave=False, disable=quiet or None):
        table, _ = table_of(strip, noise, label, k)
        if judge == "command":
            wrong += len(named_in(table, case))
        else:
            data = _data(table)
            wrong += len(named_by(data, data.rough_residuals(electrical_model(judge), case.held)))
    return wrong


@dataclass(frozen=True)
class Spiked:
    """Of ``spikes`` so many were ``named``; ``false`` rows were named that are none."""

    spikes: int
    named: int
    false: int


def spikes_named(strip: str, noise: float, count: int, *, quiet: bool = False) -> Spiked:
    """What is named in ``count`` records with spikes."""
    case, label, named, false = STEPS[strip], f"spiked:{strip}, {noise:g}", 0, 0
    for k in tqdm(range(count), leave=False, disable=quiet or None):
        table, random = table_of(strip, noise, label, k)
        current = table.columns["current"].copy()
        rows = random.choice(len(current), SPIKES, replace=False)
        current[rows] += SPIKE * float(np.abs(current).max()) * random.choice((-1.0, 1.0), SPIKES)
        found = set(named_in(replace(table, columns={**table.columns, "current": current}), case))
        named += len(found & set(rows.tolist()))
        false += len(found - set(rows.tolist()))
    return Spiked(SPIKES * count, named, false)


def main() -> list[Figure]:
    """Measure, print and write the page."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 200
    lines, figures = [*_HEAD, "## Clean sets", "", "| strip | judged by | noise | sets | false rows |"], []
    lines.append("|---|---|---|---|---|")
    for strip, judge in (("rc", "command"), ("rc", "rc"), ("rc2", "command"), ("rc2", "rc")):
        total = 0
        for noise in CLEAN_NOISE:
            wrong = false_rows(strip, noise, judge, count)
            total += wrong
            lines.append(f"| {strip} | {judge} | {noise:.1%} | {count} | {wrong} |")
            print(lines[-1], flush=True)
        told = f"{total} of {len(CLEAN_NOISE) * count} sets' rows" + ("; OUTSIDE: none is right" if total else "")
        figures.append(Figure(f"clean readings named as outliers: {strip}, judged by {judge}", told))
    lines += ["", "## Spikes of 5 % of the peak", "", "| strip | noise | spikes | named, % | false rows |"]
    lines.append("|---|---|---|---|---|")
    for strip in ("rc", "rc2"):
        for noise in SPIKED_NOISE:
            found = spikes_named(strip, noise, count)
            part = found.named / found.spikes
            lines.append(f"| {strip} | {noise:.1%} | {found.spikes} | {100 * part:.1f} | {found.false} |")
            print(lines[-1], flush=True)
            told = f"{100 * part:.1f} % of {found.spikes}, {found.false} false rows"
            told += "; OUTSIDE: fewer than 95 %" if part < LEAST_NAMED else ""
            figures.append(Figure(f"spikes of 5 % of the peak that are named: {strip}, noise {noise:.1%}", told))
    OUT.write_text("\n".join([*lines, ""]), encoding="utf-8")
    return figures


_HEAD = (
    "# Outliers of currents",
    "",
    "Written by `python benchmarks/outliers.py`, which says what is in the sets. No reading of a clean set is to be",
    "named, nor by a model that is too simple, and at least 95 % of spikes of 5 % of the peak are to be.",
    "",
)


if __name__ == "__main__":
    astray = [f"{figure.stated}: {figure.measured}" for figure in main() if "OUTSIDE" in figure.measured]
    if astray:
        raise SystemExit("\n".join(astray))
