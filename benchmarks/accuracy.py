"""Figures of the documentation that are no times: measured again with the package's own calls.

Third-party measurements are looked for beside the project, in ../shared/data; without them their figures are left out.

python benchmarks/accuracy.py
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from figure import Figure

from ilg_circuit.simulation import closed_forms as formulas
from ilg_circuit.simulation.drives import parse_drive
from ilg_circuit.simulation.response import SIMULATION_ACCURACY, simulate
from ilg_circuit.strip.actuator import PAPER
from ilg_circuit.strip.elements import lumped_elements

DATA = Path(__file__).parents[1].parent / "shared" / "data"


def simulation() -> list[Figure]:
    """The static displacement of the paper's strip by ngspice against EC (34)."""
    t = np.linspace(0.5, 300.0, 600)
    response = simulate(PAPER, parse_drive("step:4V", 300.0), t, beam="static")
    c = PAPER.coupling
    assert c is not None
    ratio = lumped_elements(PAPER).bending_ratio
    exact = 4.0 * formulas.displacement_step(t, c.gain, c.zero, c.damping_ratio, c.natural_frequency, ratio)
    worst = float(np.abs(response.displacement / exact - 1).max())
    return [Figure("`simulate` aims at 1e-9", f"{worst:.1e} from EC (34), every sample's own value")] * (
        worst < SIMULATION_ACCURACY
    )


def supercapacitor() -> list[Figure]:
    """Two spectra of a carbon supercapacitor."""
    from ilg_circuit.identification import identify
    from ilg_circuit.measurements.read import read_spectrum

    found = [identify(read_spectrum(p)) for p in sorted((DATA / "eis_supercap").glob("eis_*.txt"))]
    if not found:
        return []
    shares = {
        model: np.mean([c.relative_rms for f in found for c in f.candidates if c.relative_rms and c.model == model])
        for model in ("rc", "rc2", "warburg")
    }
    left = " ".join(f"{model} {share:.1%}" for model, share in shares.items())
    return [
        Figure("Kramers-Kronig residuals 0.10 % rms", f"{np.mean([f.check.rms for f in found if f.check]):.2%}"),
        Figure(
            "leaves 16.5 % rms of abs(Z), two 9.3 %, the finite Warburg element 7.0 %",
            f"{left}; chosen: {', '.join(f.model for f in found)}",
        ),
    ]


def rubber() -> list[Figure]:
    """Treloar's three tests by three Ogden terms."""
    from ilg_circuit.hyperelastic import LoadTest, fit_model

    names = {"uniaxial": "UT", "equibiaxial": "ET", "planar": "PS"}
    files = {mode: DATA / "treloar" / f"Treloar_1944_{code}.txt" for mode, code in names.items()}
    if not all(path.is_file() for path in files.values()):
        return []
    tables = {mode: np.loadtxt(path) for mode, path in files.items()}
    tests = [LoadTest(mode, t[:, 1], 1e6 * t[:, 0], mode) for mode, t in tables.items()]
    fit = fit_model(tests, "ogden", 3)
    rms = ", ".join(f"{1e-6 * np.sqrt(np.mean(r**2)):.3f}" for r in fit.residuals)
    return [Figure("three terms fit with 0.083, 0.044 and 0.031 MPa rms", f"{rms} MPa")]


def rhythm() -> list[Figure]:
    """What the paper's rhythm keeps behind the paper's circuit, by ngspice."""
    from ilg_circuit.arms.coupling import couple
    from ilg_circuit.oscillators.network import unit

    rows = (
        ("| 1.035 s, the paper's | 2.4%, −89° | 0.44%, −91° |", 1.0),
        ("| 10.35 s | 24%, −76° | 4.6%, −100° |", 10.0),
    )
    rows += (("| 103.5 s | 92%, −22° | 97.5%, −56° |", 100.0),)
    found = []
    for stated, slower in rows:
        told = []
        for mode in ("charge", "circuit"):
            scale = couple(unit(), 1, 2.0 * slower, mode=mode, slower=slower).scales[0]
            told.append(f"{scale.kept:.2%}, {scale.phase:.0f}°")
        found.append(Figure(stated, "; ".join(told)))
    return found


def beam() -> list[Figure]:
    """Natural frequencies of the arm beside Euler and Bernoulli's."""
    from ilg_circuit.arms import strip_arm
    from ilg_circuit.arms.statics import natural_frequencies

    arm = strip_arm()
    exact = arm.first_frequency * np.array([1.0, (4.694091 / 1.875104) ** 2])
    off = [natural_frequencies(replace(arm, segments=n), 2) / exact - 1 for n in (15, 30)]
    told = [", ".join(f"{x:+.1%}" for x in pair) for pair in off]
    return [
        Figure("first frequency is\n0.4% high, the second 3%", told[0]),
        Figure("with 30, 0.1% low and 0.3%", told[1]),
    ]


def reach() -> list[Figure]:
    """The share of the disc that the tip comes near to."""
    from ilg_circuit.arms import strip_arm
    from ilg_circuit.arms.reach import reach_target

    arm = strip_arm()
    found = reach_target(arm, (arm.length * 2 / 3, arm.length / 2), 6.0)
    return [Figure("0.2% of the disc of the arm's length", f"{found.share:.2%}")]


PARTS: tuple[Callable[[], list[Figure]], ...] = (simulation, supercapacitor, rubber, rhythm, beam, reach)


def main() -> list[Figure]:
    """Measure and print."""
    figures = [figure for part in PARTS for figure in part()]
    for figure in figures:
        print(figure.row("accuracy.py"))
    return figures


if __name__ == "__main__":
    main()
