"""CPG's items: the rhythm, the motions, and what the circuit leaves of it; of the long items short runs of parts."""

from __future__ import annotations

import cmath
import math

import numpy as np
import pytest

from ilg_circuit.oscillators.rhythm import rhythm
from ilg_circuit.reproduce import ITEMS, Outcome, run
from ilg_circuit.reproduce.cpg_rhythm import edge
from ilg_circuit.reproduce.paper_runs import PaperRuns
from ilg_circuit.reproduce.published import published


def outcome(name: str) -> Outcome:
    (found,) = run([item for item in ITEMS if item.id == name])
    return found


def test_the_rhythm() -> None:
    found = outcome("CPG-R")
    assert found.status == "agrees", found.to_dict()
    assert found.reproduction is not None
    values = {row.paper.item: row.ours for row in found.reproduction.rows}
    assert values["period"] == pytest.approx(1.035463, abs=5e-7)
    assert values["amplitude"] == pytest.approx(0.462008, abs=5e-7)


def test_the_commands_measure_motions_by_the_papers_amplitude() -> None:
    words = [line.split() for item in ITEMS for line in item.commands if "--reference" in line]
    assert len(words) >= 3
    amplitude = rhythm(PaperRuns().network()).amplitude
    assert [float(w[w.index("--reference") + 1]) for w in words] == pytest.approx([amplitude] * len(words), rel=1e-5)


def test_an_edge_is_bracketed() -> None:
    runs = PaperRuns()
    assert edge(lambda t: runs.network(2, rise_time=t), 0.3, 0.6, 2e-3) == pytest.approx(0.45, abs=2e-3)


class TestWithTheArm:
    @pytest.fixture(autouse=True)
    def _needs_the_arm(self) -> None:
        pytest.importorskip("numba")
        pytest.importorskip("xarray")

    @pytest.mark.parametrize("name", ["CPG-F10", "CPG-F12", "CPG-S"])
    def test_motions_keep_their_laws(self, name: str) -> None:
        found = outcome(name)
        assert found.status == "agrees", found.to_dict()
        assert found.reproduction is not None
        assert found.reproduction.figure is not None
        assert any("does not give the mutual inhibition a" in text for text in found.reproduction.unknown)

    def test_a_slow_rhythm_passes_through_the_circuit(self) -> None:
        from ilg_circuit.arms.coupling import couple
        from ilg_circuit.reproduce.cpg_circuit import fundamental

        runs = PaperRuns()
        period = 100 * runs.two_period
        ratio = fundamental(couple(runs.network(2), 1, 4 * period, mode="circuit", slower=100), period)
        kept, phase = (float(published("cpg_circuit", f"circuit_{name}_100").recomputed) for name in ("kept", "phase"))
        assert 100 * abs(ratio) == pytest.approx(kept, abs=0.05)
        assert math.degrees(cmath.phase(ratio)) == pytest.approx(phase, abs=0.5)

    def test_the_circuit_leaves_little_of_the_motion(self) -> None:
        from ilg_circuit.reproduce.cpg_motion import move

        runs = PaperRuns()
        ideal, real = (move(runs, runs.network(), mode=mode) for mode in ("ideal", "circuit"))
        assert real.largest < 0.03 * ideal.largest
        assert np.linalg.norm(ideal.displacement[0]) == 0.0
