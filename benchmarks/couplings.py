"""Is the law of bending recognised, and do its intervals hold the truth? Noisy steps of known strips tell.

python benchmarks/couplings.py [sets a law, default 200] [--state FILE] [--workers N] [--law NAME ...]
    writes COUPLINGS.md; sets that the file of the state has are not measured again

A strip with the paper's circuit, on a static beam, is stepped to 2 V after 10 s of rest and read every 0.2 s for 100 s;
the noise of the displacement is 1 % of its span. Every set draws the constants of its law anew and goes through
`identify` as a user's file does. Time constants are at least a factor of 4 apart. Three relaxations of the voltage of
which one has the time constant Rd C = 6.8 s are the charge and two relaxations of it; the middle one is drawn from 8 to
12 s. The last column tells of sets in which another law was chosen how many name the true one beside it, as one that
the data do not tell apart. The seeds are fixed.
"""

from __future__ import annotations

import argparse
import json
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from figure import Figure

from ilg_circuit.drive import PiecewiseLinear
from ilg_circuit.errors import IlgError
from ilg_circuit.identification import identify
from ilg_circuit.measurements.prepare import prepare
from ilg_circuit.measurements.table import Table
from ilg_circuit.simulation.response import simulate
from ilg_circuit.strip.actuator import PAPER, Coupling, CouplingLaw
from ilg_circuit.strip.couplings import ChargeCoupling, VoltageRelaxations

OUT = Path(__file__).with_name("COUPLINGS.md")
STEP, TIME, REST = PiecewiseLinear.step(2.0), np.arange(0.0, 100.1, 0.2), np.arange(-10.0, 0.0, 0.2)
NOISE, CURRENT_NOISE, SEED = 0.01, 1e-4, 20261127
LAWS = ("ec31", "charge1", "charge2", "voltage1", "voltage2", "voltage3", "fractional")


def drawn(law: str, random: np.random.Generator) -> CouplingLaw:
    """Return a coupling of a law with constants drawn at random."""
    first = random.uniform(0.8, 1.6) * 100e-9
    fast, middle, slow = random.uniform(1.0, 2.0), random.uniform(8.0, 12.0), random.uniform(40.0, 60.0)
    back = -first * random.uniform(0.4, 0.7)
    if law == "ec31":
        frequency = random.uniform(0.1, 0.4)
        damping, zero = random.uniform(0.4, 0.8), random.uniform(0.1, 0.3)
        return Coupling(first * frequency**2 / zero, zero, damping, frequency)
    if law == "charge1":
        return ChargeCoupling(instantaneous=first, gain_1=back, time_1=random.uniform(15.0, 30.0))
    if law == "charge2":
        return ChargeCoupling(
            instantaneous=first, gain_1=1.5 * back, time_1=random.uniform(2.0, 3.0), gain_2=first * 0.6, time_2=slow / 2
        )
    if law == "voltage1":
        return VoltageRelaxations(gain_1=first, time_1=middle)
    if law == "voltage2":  # beyond the rest: d(s) otherwise
        return VoltageRelaxations(gain_1=first, time_1=fast, gain_2=-1.5 * first, time_2=slow / 2)
    if law == "fractional":
        return VoltageRelaxations(
            gain_1=back,
            time_1=slow / 2,
            fractional_gain=first,
            fractional_time=fast,
            fractional_exponent=random.uniform(0.6, 0.8),
        )
    return VoltageRelaxations(gain_1=first, time_1=fast, gain_2=1.5 * back, time_2=middle, gain_3=first, time_3=slow)


def measured(law: CouplingLaw, random: np.random.Generator) -> Table:
    """Return the record of a strip that bends by ``law``."""
    run = simulate(replace(PAPER, coupling=law), STEP, TIME, engine="exact", beam="static")
    still, time = np.zeros(len(REST)), np.append(REST, TIME)
    moved, current = np.append(still, run.displacement), np.append(still, run.current)
    moved = moved + NOISE * np.ptp(moved) * random.standard_normal(len(time))
    current = current + CURRENT_NOISE * run.current.max() * random.standard_normal(len(time))
    voltage = np.where(time < 0, 0.0, 2.0)
    columns = {"time": time + 10, "voltage": voltage, "current": current, "displacement": moved}
    return Table(columns, "record.csv")


def outcome(task: tuple[str, int]) -> dict[str, Any]:
    """Return what became of a set: the law chosen, those named beside it, and which intervals hold the truth."""
    name, k = task
    random = np.random.default_rng([SEED, LAWS.index(name), k])
    law = drawn(name, random)
    row: dict[str, Any] = {"law": name, "set": k, "chosen": "no fit", "beside": [], "held": {}}
    try:
        found = identify(prepare(measured(law, random), "first-level"), base=PAPER, model="rc", engine="exact")
    except IlgError:
        return row
    if found.coupling is None:
        return row
    row["chosen"] = found.coupling.motion.law.name
    row["beside"] = [each.law for each in found.coupling.laws if each.alike]
    if row["chosen"] != name:
        return row
    for label, estimate in found.parameters.items():
        true = getattr(law, label.removeprefix("coupling_"), None)
        if label.startswith("coupling_") and true is not None and estimate.interval is not None:
            row["held"][label] = bool(estimate.interval[0] <= true <= estimate.interval[1])
    return row


@dataclass
class Score:
    """How often each law was chosen for sets of one, and of intervals how many held the truth, by parameter.

    ``named`` counts the sets in which the law was not chosen, but named beside the one that was.
    """

    chosen: Counter[str] = field(default_factory=Counter)
    held: Counter[str] = field(default_factory=Counter)
    given: Counter[str] = field(default_factory=Counter)
    named: int = 0

    def add(self, row: dict[str, Any]) -> None:
        """Count a set."""
        self.chosen[row["chosen"]] += 1
        self.named += row["law"] in row["beside"]
        self.given.update(list(row["held"]))
        self.held.update(label for label, holds in row["held"].items() if holds)


def scored(tasks: list[tuple[str, int]], workers: int, state: Path | None) -> Iterator[dict[str, Any]]:
    """Yield what became of each set, from the ``state`` where it is there; others are added to it."""
    known = state.read_text(encoding="utf-8").splitlines() if state is not None and state.exists() else []
    rows = {(row["law"], row["set"]): row for row in map(json.loads, known)}
    yield from (rows[task] for task in tasks if task in rows)
    left = [task for task in tasks if task not in rows]
    pool = ProcessPoolExecutor(workers) if workers > 1 and left else None
    try:
        for row in pool.map(outcome, left) if pool is not None else map(outcome, left):
            if state is not None:
                with state.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(row) + "\n")
            yield row
    finally:
        if pool is not None:
            pool.shutdown(cancel_futures=True)


def page(scores: dict[str, Score]) -> str:
    """Return the page of all scores."""
    about = (__doc__ or "").split("\n\n", 2)[2].strip().replace("\n", " ")
    lines = ["# Recognising the law of bending", "", about, ""]
    lines += ["| law | sets | recognised | taken for | named beside it, of those |", "|---|---|---|---|---|"]
    for name, score in scores.items():
        sets, right = score.chosen.total(), score.chosen[name]
        others = ", ".join(f"{other} {count}" for other, count in score.chosen.most_common() if other != name)
        named = f"{score.named} of {sets - right}" if right < sets else ""
        lines.append(f"| {name} | {sets} | {right / sets:.1%} | {others} | {named} |")
    lines += ["", "95 % intervals that hold the truth, of the sets that were recognised:", ""]
    lines += ["| law | parameter | sets | held |", "|---|---|---|---|"]
    for name, score in scores.items():
        lines += [f"| {name} | {p} | {n} | {score.held[p] / n:.1%} |" for p, n in score.given.items()]
    return "\n".join(lines) + "\n"


def main() -> list[Figure]:
    """Measure and write the page; return how often each law was recognised, and the least coverage of its intervals."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("sets", type=int, nargs="?", default=200, help="sets a law")
    parser.add_argument("--state", type=Path, help="file of the sets that are done, one a line")
    parser.add_argument("--workers", type=int, default=1, help="processes")
    parser.add_argument("--law", nargs="+", choices=LAWS, default=LAWS, help="laws to measure")
    given = parser.parse_args()
    tasks = [(name, k) for k in range(given.sets) for name in given.law]
    scores = {name: Score() for name in given.law}
    for row in scored(tasks, given.workers, given.state):
        scores[row["law"]].add(row)
    OUT.write_text(page(scores), encoding="utf-8")
    figures = []
    for name, score in scores.items():
        print(name, dict(score.chosen), flush=True)
        least = min((score.held[p] / n for p, n in score.given.items()), default=0.0)
        told = f"{score.chosen[name] / given.sets:.1%} of {given.sets}"
        figures.append(Figure(f"law of bending recognised: {name}", f"{told}; least coverage of intervals {least:.1%}"))
    return figures


if __name__ == "__main__":
    main()
