"""Is the law of bending recognised, and do its intervals hold the truth? Noisy steps of known strips tell.

python benchmarks/couplings.py [sets a law, default 200] [--workers N] [--law NAME ...] [--again]
    writes COUPLINGS.md; sets that `counted/` has are not measured again

A strip with the paper's circuit, on a static beam, is stepped to 2 V after 10 s of rest and read every 0.2 s for 100 s;
the noise of the displacement is 1 % of its span. Every set draws the constants of its law anew and goes through
`identify` as a user's file does. Time constants are at least a factor of 4 apart. Three relaxations of the voltage of
which one has the time constant Rd C = 6.8 s are the charge and two relaxations of it; the middle one is drawn from 8 to
12 s. The last column tells of sets in which another law was chosen how many name the true one beside it, as one that
the data do not tell apart. The seeds are fixed.
"""

from __future__ import annotations

import argparse
from collections import Counter
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from counted import Block, Counts, blocks, heading, options, summed, total
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


def outcome(name: str, k: int) -> Counts:
    """Return what became of a set: the law that was ``chosen``, and of its intervals which ``held`` the truth.

    Where another law was chosen, ``named`` tells whether the true one is named beside it.
    """
    random = np.random.default_rng([SEED, LAWS.index(name), k])
    law = drawn(name, random)
    table = measured(law, random)
    counts: Counts = {"chosen": {"no fit": 1}, "held": {}, "given": {}, "named": 0}
    try:
        found = identify(prepare(table, "first-level"), base=PAPER, model="rc", engine="exact")
    except IlgError:
        return counts
    if found.coupling is None:
        return counts
    chosen = found.coupling.motion.law.name
    counts["chosen"] = {chosen: 1}
    if chosen != name:
        return counts | {"named": int(name in [each.law for each in found.coupling.laws if each.alike])}
    for label, estimate in found.parameters.items():
        true = getattr(law, label.removeprefix("coupling_"), None)
        if label.startswith("coupling_") and true is not None and estimate.interval is not None:
            counts["given"][label] = 1
            counts["held"][label] = int(estimate.interval[0] <= true <= estimate.interval[1])
    return counts


def page(found: list[Block]) -> str:
    """Return the page of what the blocks ``found`` counted."""
    lines = heading("Recognising the law of bending", __doc__, found)
    lines += ["| law | sets | recognised | taken for | named beside it, of those |", "|---|---|---|---|---|"]
    scores = {name: counts for name in LAWS if (counts := total(found, name))}
    for name, counts in scores.items():
        sets, right = sum(counts["chosen"].values()), counts["chosen"].get(name, 0)
        taken = Counter({other: n for other, n in counts["chosen"].items() if other != name})
        others = ", ".join(f"{other} {n}" for other, n in taken.most_common())
        named = f"{counts['named']} of {sets - right}" if right < sets else ""
        lines.append(f"| {name} | {sets} | {right / sets:.1%} | {others} | {named} |")
    lines += ["", "95 % intervals that hold the truth, of the sets that were recognised:", ""]
    lines += ["| law | parameter | sets | held |", "|---|---|---|---|"]
    for name, counts in scores.items():
        lines += [f"| {name} | {p} | {n} | {counts['held'][p] / n:.1%} |" for p, n in counts["given"].items()]
    return "\n".join(lines) + "\n"


def main() -> list[Figure]:
    """Measure and write the page; return how often each law was recognised, and the least coverage of its intervals."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("sets", type=int, nargs="?", default=200, help="sets a law")
    parser.add_argument("--law", nargs="+", choices=LAWS, default=LAWS, help="laws to measure")
    options(parser)
    given = parser.parse_args()
    found = blocks("couplings", given.law, given.sets, partial(summed, outcome), given)
    OUT.write_text(page(found), encoding="utf-8")
    figures = []
    for name in given.law:
        counts = total(found, name)
        print(name, counts["chosen"], flush=True)
        sets = sum(counts["chosen"].values())
        least = min((counts["held"][p] / n for p, n in counts["given"].items()), default=0.0)
        told = f"{counts['chosen'].get(name, 0) / sets:.1%} of {sets}; least coverage of intervals {least:.1%}"
        figures.append(Figure(f"law of bending recognised: {name}", told))
    return figures


if __name__ == "__main__":
    main()
