"""Is the law of bending recognised, and do its intervals hold the truth? Noisy steps of known strips tell.

python benchmarks/couplings.py [sets a law, default 200]     writes COUPLINGS.md

A strip with the paper's circuit, on a static beam, is stepped to 2 V after 10 s of rest and read every 0.2 s for 100 s;
the noise of the displacement is 1 % of its span. Every set draws the constants of its law anew, time constants at least
a factor of 4 apart, and goes through `identify` as a user's file does. The seeds are fixed.
"""

from __future__ import annotations

import sys
from collections import Counter
from dataclasses import dataclass, field, replace
from pathlib import Path

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
NOISE, CURRENT_NOISE, SEED = 0.01, 1e-4, 20261126


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
    if law == "voltage3":
        return VoltageRelaxations(
            gain_1=first, time_1=fast, gain_2=1.5 * back, time_2=middle, gain_3=first, time_3=slow
        )
    return VoltageRelaxations(
        gain_1=back,
        time_1=slow / 2,
        fractional_gain=first,
        fractional_time=fast,
        fractional_exponent=random.uniform(0.6, 0.8),
    )


LAWS = ("ec31", "charge1", "charge2", "voltage1", "voltage2", "voltage3", "fractional")


@dataclass
class Score:
    """How often each law was chosen for sets of one, and of intervals how many held the truth, by parameter."""

    chosen: Counter[str] = field(default_factory=Counter)
    held: Counter[str] = field(default_factory=Counter)
    given: Counter[str] = field(default_factory=Counter)


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


def scored(name: str, sets: int) -> Score:
    """Return the score of ``sets`` of a law."""
    score = Score()
    for k in range(sets):
        random = np.random.default_rng([SEED, LAWS.index(name), k])
        law = drawn(name, random)
        record = prepare(measured(law, random), "first-level")
        try:
            found = identify(record, base=PAPER, model="rc", engine="exact")
        except IlgError:
            score.chosen["no fit"] += 1
            continue
        got = found.coupling.motion.law.name if found.coupling is not None else "no fit"
        score.chosen[got] += 1
        if got != name:
            continue
        for label, estimate in found.parameters.items():
            true = getattr(law, label.removeprefix("coupling_"), None)
            if label.startswith("coupling_") and true is not None and estimate.interval is not None:
                score.given[label] += 1
                score.held[label] += estimate.interval[0] <= true <= estimate.interval[1]
    return score


def page(scores: dict[str, Score], sets: int) -> str:
    """Return the page of all scores."""
    lines = ["# Recognising the law of bending", "", (__doc__ or "").split("\n\n", 2)[2].strip().replace("\n", " "), ""]
    lines += [f"{sets} sets a law.", "", "| law | recognised | taken for |", "|---|---|---|"]
    for name, score in scores.items():
        others = ", ".join(f"{other} {count}" for other, count in score.chosen.most_common() if other != name)
        lines.append(f"| {name} | {score.chosen[name] / sets:.1%} | {others} |")
    lines += ["", "95 % intervals that hold the truth, of the sets that were recognised:", ""]
    lines += ["| law | parameter | sets | held |", "|---|---|---|---|"]
    for name, score in scores.items():
        lines += [f"| {name} | {p} | {n} | {score.held[p] / n:.1%} |" for p, n in score.given.items()]
    return "\n".join(lines) + "\n"


def main() -> list[Figure]:
    """Measure and write the page; return how often each law was recognised, and the least coverage of its intervals."""
    sets = int(sys.argv[1]) if len(sys.argv) > 1 else 200
    scores = {}
    for name in LAWS:
        scores[name] = scored(name, sets)
        print(name, sets, dict(scores[name].chosen), flush=True)
        OUT.write_text(page(scores, sets), encoding="utf-8")
    figures = []
    for name, score in scores.items():
        least = min((score.held[p] / n for p, n in score.given.items()), default=0.0)
        told = f"{score.chosen[name] / sets:.1%} of {sets}; least coverage of its intervals {least:.1%}"
        figures.append(Figure(f"law of bending recognised: {name}", told))
    return figures


if __name__ == "__main__":
    main()
