"""Does the 95 % band of a prediction hold records that no fit has seen? Strips that the model describes, and others.

python benchmarks/bands.py [sets a kind, default 100] [--workers N] [--kind NAME ...] [--again]
    writes BANDS.md; sets that `counted/` has are not measured again

A strip is drawn at random, stepped to 2 V after 10 s of rest, read every 0.5 s for 100 s, and fitted: by a circuit and
a law of bending that describe it, or by ones that do not. Four further records of the same strip follow under steps,
square waves, sines and staircases of at most 2 V, also of 100 s. The noise of the current is 0.1 % of its peak, that of
the displacement 1 % of its span. Each is predicted with a band, which holds the uncertainty of the parameters and the
misfit that the fit left of its own record. A reading is held where it lies within 1.96 standard errors of band and
noise together. A record is named where the command says that it lies outside the band. The seeds are fixed.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from counted import Block, Counts, blocks, heading, joined, options, summed, total
from figure import Figure

from ilg_circuit.arrays import Array
from ilg_circuit.drive import Drive, PiecewiseLinear, Sine
from ilg_circuit.errors import IlgError
from ilg_circuit.identification import identify
from ilg_circuit.identification.comparison import compare, outside_findings
from ilg_circuit.measurements.prepare import prepare
from ilg_circuit.measurements.record import Record
from ilg_circuit.measurements.table import Table
from ilg_circuit.simulation.response import simulate
from ilg_circuit.strip.actuator import PAPER, Actuator
from ilg_circuit.strip.couplings import ChargeCoupling
from ilg_circuit.strip.elements import lumped_port
from ilg_circuit.strip.models import electrical_model
from ilg_circuit.strip.port import Port

OUT = Path(__file__).with_name("BANDS.md")
TIME, REST = np.arange(0.0, 100.1, 0.5), np.arange(-10.0, 0.0, 0.5)
LARGEST, CURRENT_NOISE, MOTION_NOISE, SEED = 2.0, 1e-3, 0.01, 20261128


@dataclass(frozen=True)
class Kind:
    """What a strip is, and the circuit and the law of bending that are fitted to it."""

    is_a: str
    model: str
    law: str = "ec31"


KINDS = {
    "described": Kind("one branch, d(s)", "rc"),
    "three branches by one": Kind("three branches, d(s)", "rc"),
    "three branches by two": Kind("three branches, d(s)", "rc2"),
    "CPE by two branches": Kind("constant-phase element, d(s)", "rc2"),
    "growing by constant": Kind("capacitance that grows with the voltage, d(s)", "rc"),
    "sinh by linear": Kind("electron path that is a sinh of the voltage, d(s)", "rc"),
    "charge by d(s)": Kind("one branch, motion that follows the charge and relaxes back", "rc"),
}


def drawn(kind: str, random: np.random.Generator) -> Actuator:
    """Return a strip of a kind with constants drawn at random."""

    def about(value: float, factor: float = 1.5) -> float:
        return float(value * factor ** random.uniform(-1, 1))

    dc, ions, gain = about(600.0), (about(25.0), about(0.3)), about(100e-9)
    port = Port(dc, (ions,))
    if kind.startswith("three"):
        port = Port(dc, ((about(25.0), about(0.15)), (about(60.0), about(0.2)), (about(300.0), about(0.1))))
    elif kind.startswith("CPE"):
        port = electrical_model("cpe").port((dc, about(10.0), about(0.05), random.uniform(0.75, 0.95)), 0.0)
    elif kind.startswith("growing"):
        port = Port(dc, (ions,), capacitance_slope=random.uniform(0.05, 0.3))
    elif kind.startswith("sinh"):
        port = Port(dc, (ions,), emission_voltage=random.uniform(1.0, 2.0))
    strip = Actuator.from_port(PAPER.geometry, port, base=PAPER.material)
    relaxing = ChargeCoupling(instantaneous=gain, gain_1=-0.5 * gain, time_1=about(20.0))
    return replace(strip, coupling=relaxing if kind.startswith("charge") else PAPER.coupling)


def drives(random: np.random.Generator) -> list[Drive]:
    """Return a drive of each sort that no fit has seen, of at most the fitted voltage."""

    def level() -> float:
        return float(random.choice([-1.0, 1.0]) * random.uniform(0.3, 1.0) * LARGEST)

    stairs = [level() for _ in range(4)]
    knots = np.repeat(np.arange(1, 4) * 25.0, 2)
    return [
        PiecewiseLinear.step(level()),
        PiecewiseLinear.square(0.0, level(), random.uniform(10.0, 60.0), TIME[-1]),
        Sine(abs(level()), float(np.exp(random.uniform(np.log(0.01), np.log(0.2))))),
        PiecewiseLinear(np.r_[0.0, knots, TIME[-1]], np.repeat(stairs, 2)),
    ]


def measured(strip: Actuator, drive: Drive, random: np.random.Generator) -> Record:
    """Return the record of a strip under a drive, with rest before it, and noise."""
    engine = "exact" if lumped_port(strip).linear else "ngspice"
    run = simulate(strip, drive, TIME, engine=engine, beam="static")
    still = np.zeros(len(REST))

    def noisy(values: Array, size: float) -> Array:
        return np.append(still, values) + size * random.standard_normal(len(REST) + len(TIME))

    columns = {
        "time": np.append(REST, TIME) - REST[0],
        "voltage": np.append(still, run.voltage),
        "current": noisy(run.current, CURRENT_NOISE * float(np.abs(run.current).max())),
        "displacement": noisy(run.displacement, MOTION_NOISE * float(np.ptp(run.displacement))),
    }
    return prepare(Table(columns, "record.csv"), "first-level")


def outcome(kind: str, k: int) -> Counts:
    """Return what the band of one fit holds: by quantity the ``readings`` of the records, and those ``held``.

    ``plain`` are those that a band without the misfit holds; of ``records`` some are ``named`` as outside.
    """
    random = np.random.default_rng([SEED, list(KINDS).index(kind), k])
    strip, how = drawn(kind, random), KINDS[kind]
    try:
        first = measured(strip, PiecewiseLinear.step(LARGEST), random)
        found = identify(first, base=PAPER, model=how.model, law=how.law, engine="exact").actuator
    except IlgError:
        return {"no fit": 1, "refused": 0}
    assert found.uncertainty is not None
    plain = replace(found, uncertainty=replace(found.uncertainty, residuals=()))
    counts: Counts = {"no fit": 0, "refused": 0}
    for drive in drives(random):
        try:
            record = measured(strip, drive, random)
        except IlgError:
            counts["refused"] += 1
            continue
        parts = compare(found, record, band=True, engine="exact", beam="static")
        named = [finding.values["quantity"] for finding in outside_findings(parts)]
        bare = compare(plain, record, band=True, engine="exact", beam="static")
        for part, without in zip(parts, bare, strict=True):
            readings = len(part.time)
            more = {
                "readings": readings,
                "held": round(readings * (part.covered or 0.0)),
                "plain": round(readings * (without.covered or 0.0)),
                "records": 1,
                "named": int(part.quantity in named),
            }
            counts = joined(counts, {part.quantity: more})
    return counts


def page(found: list[Block]) -> str:
    """Return the page of what the blocks ``found`` counted."""
    lines = heading("Bands of predictions", __doc__, found)
    lines += ["| strip | fitted | quantity | records | readings held | without the misfit | records named |"]
    lines += ["|---|---|---|---|---|---|---|"]
    for kind, how in KINDS.items():
        for quantity, c in total(found, kind).items():
            if isinstance(c, dict):
                held, plain = c["held"] / c["readings"], c["plain"] / c["readings"]
                cells = [how.is_a, f"{how.model}, {how.law}", quantity, f"{c['records']}"]
                cells += [f"{share:.1%}" for share in (held, plain, c["named"] / c["records"])]
                lines.append(f"| {' | '.join(cells)} |")
    counts = [total(found, kind) for kind in KINDS]
    lost, refused = (sum(c.get(name, 0) for c in counts) for name in ("no fit", "refused"))
    lines += ["", f"{lost} strips were not fitted, {refused} records were refused as broken."]
    return "\n".join(lines) + "\n"


def main() -> list[Figure]:
    """Measure and write the page; return the share of readings that the band holds, by kind and quantity."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("sets", type=int, nargs="?", default=100, help="sets a kind")
    parser.add_argument("--kind", nargs="+", choices=list(KINDS), default=list(KINDS), help="kinds to measure")
    options(parser)
    given = parser.parse_args()
    found = blocks("bands", given.kind, given.sets, partial(summed, outcome), given)
    OUT.write_text(page(found), encoding="utf-8")
    figures = []
    for kind in given.kind:
        for quantity, c in total(found, kind).items():
            if isinstance(c, dict):
                told = f"{c['held'] / c['readings']:.1%} of the readings of {c['records']} records"
                print(f"{kind}, {quantity}: {told}", flush=True)
                figures.append(Figure(f"band holds records that no fit has seen: {kind}, {quantity}", told))
    return figures


if __name__ == "__main__":
    main()
