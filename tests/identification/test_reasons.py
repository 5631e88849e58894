"""The choice explained: what decided, what each candidate lacks, and that a rejected best one is told."""

from __future__ import annotations

import json

import numpy as np
import pytest
from synthetic import noisy_factor
from test_impedance_fit import spectrum as spectrum_of_model

from ilg_circuit.errors import InputError
from ilg_circuit.findings import Finding, codes
from ilg_circuit.fit.selection import CLEAR, EVIDENCE, Candidate, clearly_better, simplest_of_best
from ilg_circuit.identification import identify
from ilg_circuit.identification.identification import Identification
from ilg_circuit.identification.port_findings import rejected_findings
from ilg_circuit.measurements.columns import read_data
from ilg_circuit.measurements.spectrum import Spectrum


def constant_phase_chain() -> Spectrum:
    """No model that auto tries makes it: rc3 is closest."""
    f = np.geomspace(0.1, 1e5, 49)
    s = 2j * np.pi * f
    z = 95 + 1 / (1 / 1100 + 2e-5 * s**0.72) + 1 / (1.05e-4 * s**0.86)
    return Spectrum("chain.csv", f, z * noisy_factor(len(f), 1e-4, 0))


@pytest.fixture(scope="module")
def chain() -> Identification:
    return identify(constant_phase_chain())


@pytest.fixture(scope="module")
def undetermined() -> Identification:
    """A spectrum of one pole."""
    return identify(spectrum_of_model("rc", 0.005), electrode_resistance=1.0)


# -- the rule ----------------------------------------------------------------------------------------------------------


def test_a_clearly_better_model_does_not_lose_whatever_the_bic() -> None:
    bics, unknowns = {"a": 0.0, "b": EVIDENCE - 1}, {"a": 2, "b": 5}
    assert simplest_of_best(bics, unknowns, unknowns, {"a": 1.51, "b": 1.0}) == "b"
    assert simplest_of_best(bics, unknowns, unknowns, {"a": 1.49, "b": 1.0}) == "a"
    assert simplest_of_best({"a": 0.0, "b": 99.0}, unknowns, unknowns, {"a": 1.51, "b": 1.0}) == "b"
    assert simplest_of_best(bics, unknowns, ["a"], {"a": 9.0, "b": 1.0}) == "a", "what is refused wins nothing"


def test_misfits_of_rounding_are_no_difference() -> None:
    assert clearly_better(1e-3, CLEAR * 1.01e-3)
    assert not clearly_better(1e-9, 1e-7)


# -- the table ---------------------------------------------------------------------------------------------------------


def test_the_clearly_better_model_of_a_chain_is_chosen(chain: Identification) -> None:
    rms = {c.model: c.misfit for c in chain.candidates if c.misfit is not None}
    assert chain.model == min(rms, key=rms.__getitem__) == "rc3"
    assert all(r > CLEAR * rms["rc3"] for m, r in rms.items() if m != "rc3")


@pytest.mark.parametrize("result", ["chain", "undetermined"])
def test_every_row_has_a_reason_with_numbers(result: str, request: pytest.FixtureRequest) -> None:
    found: Identification = request.getfixturevalue(result)
    (independent,) = {c.independent for c in found.candidates if c.bic is not None}
    assert independent is not None
    assert 5 <= independent <= 2 * 71
    for c, entry in zip(found.candidates, found.to_dict()["candidates"], strict=True):
        assert c.reason is not None
        assert json.loads(json.dumps(entry["reason"])) == {"code": c.reason.code, "values": dict(c.reason.values)}
        assert entry["verdict"] == c.verdict == str(c.reason)
        assert c.chosen == (c.reason.code == "candidate-chosen")
        if c.reason.code == "candidate-worse":
            chosen = next(other for other in found.candidates if other.chosen)
            assert c.bic is not None
            assert chosen.bic is not None
            assert c.reason.values["bic"] == pytest.approx(c.bic - chosen.bic)
            assert f"BIC higher than for {chosen.model} by {c.bic - chosen.bic:.1f}" in c.verdict
    assert f"BIC on {independent:.3g} independent samples for all" in found.summary()


def candidate(model: str, bic: float, misfit: float, code: str = "candidate-chosen", **values: object) -> Candidate:
    reason = Finding(code, values=values)
    return Candidate(model, bic=bic, misfit=misfit, reason=reason, chosen=code == "candidate-chosen")


def test_a_rejected_least_bic_and_a_rejected_least_rms_are_told_with_their_reasons() -> None:
    chosen = candidate("rc2", 10.0, 0.14)
    least = candidate("cpe", 6.0, 0.13, "candidate-not-enough", than="rc2", less=4.0, more=1, needed=10.0)
    closest = candidate("rc3", 8.0, 0.10, "candidate-not-confirmed", starts=20)
    (bic, rms) = rejected_findings([chosen, least, closest])
    assert (bic.code, bic.values["model"], bic.values["less"]) == ("least-bic-not-chosen", "cpe", 4.0)
    assert "less than the 10 required for 1 more unknown" in str(bic)
    assert (rms.code, rms.values["model"], rms.values["share"]) == ("least-rms-not-chosen", "rc3", 0.10)
    assert "not reached a second time" in str(rms)
    near = candidate("rc3", 12.0, 0.13, "candidate-asked-for")
    assert rejected_findings([chosen, near]) == []
    assert rejected_findings([chosen]) == []


def test_the_misfit_of_a_spectrum_has_its_place(chain: Identification) -> None:
    (finding,) = (f for f in chain.findings if f.code == "spectrum-misfit")
    row, statistics = chain.observations[0], chain.statistics
    relative = np.abs(row.residuals) / np.abs(row.data)
    assert statistics["complex_rms"] == finding.values["complex"]
    assert statistics["complex_rms"] == pytest.approx(float(np.sqrt(np.mean(relative**2))))
    window = statistics["worst_window"]
    inside = (row.abscissa >= window["from_Hz"] * 0.999) & (row.abscissa < window["to_Hz"] * 0.999)
    assert window["complex_rms"] == pytest.approx(float(np.sqrt(np.mean(relative[inside] ** 2))))
    assert window["complex_rms"] > statistics["complex_rms"]
    assert window["to_Hz"] / window["from_Hz"] == pytest.approx(10)
    assert "least-bic-not-chosen" not in codes(chain.findings)


def test_a_current_of_fewer_relaxations_than_the_model_has_says_so() -> None:
    t = np.arange(-5.0, 60.0, 0.25)
    one = np.where(t < 0, 0.0, 4 / 600 + 4 / 20 * np.exp(-t / 7))
    columns = {"time_s": t, "voltage_V": 4.0 * (t >= 0), "current_A": one}
    with pytest.raises(InputError, match=r"shows [12] relaxations?, and model rc3 has 3: take a simpler one") as raised:
        identify(read_data(columns, "step.csv"), model="rc3", engine="exact")
    assert "clamp" not in str(raised.value)
