"""Which model the data of a strip support: chosen by evidence, determined by the data, and why not another."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from kinds import KINDS, data
from synthetic import fit_current, noisy_factor, record, spectrum, step, two_branches
from test_impedance_fit import TRUTHS
from test_impedance_fit import spectrum as spectrum_of_model

from ilg_circuit.errors import SolveError
from ilg_circuit.findings import codes
from ilg_circuit.fit.multistart import StartSummary
from ilg_circuit.fit.selection import EVIDENCE, simplest_of_best
from ilg_circuit.identification import identify, selection
from ilg_circuit.identification.port_fit import PortFit
from ilg_circuit.measurements.record import Record
from ilg_circuit.measurements.spectrum import Spectrum
from ilg_circuit.strip.actuator import PAPER, Actuator

SINH = replace(PAPER, material=replace(PAPER.material, emission_voltage=0.8), coupling=None, name="sinh")
TWO = replace(two_branches(), coupling=None)


def steps(strip: Actuator, *voltages: float) -> list[Record]:
    return [
        record(step(u), 100.0, 101, strip=strip, rest=20, noise=3e-3, seed=k).measurement(f"{k}.csv")
        for k, u in enumerate(voltages)
    ]


def of_two_branches() -> list[Record | Spectrum]:
    """The spectrum ends where the slow branch begins, the step begins where the fast one is over."""
    slow = record(step(2.0), 200.0, 101, strip=TWO, rest=10, noise=3e-3, seed=1)
    return [slow.measurement("step.csv"), spectrum(TWO, 1e-2, 1e3)]


# -- the rule ----------------------------------------------------------------------------------------------------------


def test_more_parameters_need_very_strong_evidence() -> None:
    unknowns = {"a": 2, "b": 3, "c": 4}
    assert simplest_of_best({"a": EVIDENCE, "b": 0.0, "c": 1.0}, unknowns, unknowns) == "a"
    assert simplest_of_best({"a": EVIDENCE + 0.1, "b": 0.0, "c": 1.0}, unknowns, unknowns) == "b"
    assert simplest_of_best({"a": 50.0, "b": 30.0, "c": 0.0}, unknowns, ["a", "b"]) == "b"
    assert simplest_of_best({"a": 50.0, "b": 30.0, "c": 0.0}, unknowns, []) == "a", "nothing simpler exists"


# -- the model that made the data --------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", KINDS)
def test_one_pole_is_enough_for_one_pole(kind: str) -> None:
    found = identify(data(kind), base=PAPER, engine="exact")
    assert found.model == "rc"
    rows = {c.model: c for c in found.candidates}
    assert [m for m, c in rows.items() if c.chosen] == ["rc"]
    assert rows["rc"].verdict == "chosen"
    assert rows["rc2"].status != "not tried", "the check that one pole is enough"
    for model in ("rc3", "warburg"):
        if kind == "spectrum":  # whose models are all tried: a fit takes no integration
            assert rows[model].status != "not tried"
        else:
            assert (rows[model].status, rows[model].bic) == ("not tried", None)
            assert rows[model].verdict == "not tried: the residuals of rc are only noise"
    assert all(c.against for m, c in rows.items() if m != "rc")


@pytest.mark.parametrize("model", TRUTHS)
def test_auto_finds_a_spectrum_s_model(model: str) -> None:
    found = identify(spectrum_of_model(model, 0.005, 1), electrode_resistance=TRUTHS[model][1])
    assert found.model == model
    assert found.port.identifiability().determined
    assert [c.model for c in found.candidates][:5] == list(TRUTHS)


def test_auto_of_a_step_and_a_spectrum() -> None:
    found = identify(of_two_branches(), base=TWO, engine="exact")
    assert found.model == "rc2"
    assert {"cpe", "warburg", "rc3"} <= {c.model for c in found.candidates}


@pytest.mark.parametrize(
    ("strip", "voltages", "model", "verdicts"),
    [
        (replace(PAPER, coupling=None), (2.0, -1.0), "rc", {"rc3": "not tried: the residuals of rc are only noise"}),
        (replace(PAPER, coupling=None), (2.0, -2.0), "rc", {"rc+sinh": "not tried: it needs several voltages"}),
        (SINH, (1.0, -2.0, 3.0), "rc+sinh", {"rc": "BIC higher than for"}),
    ],
    ids=["linear", "one voltage", "sinh"],
)
def test_auto_of_several_records(
    strip: Actuator, voltages: tuple[float, ...], model: str, verdicts: dict[str, str]
) -> None:
    found = identify(steps(strip, *voltages), base=strip)
    assert found.model == model
    rows = {c.model: c for c in found.candidates}
    assert [m for m, c in rows.items() if c.chosen] == [model]
    for name, verdict in verdicts.items():
        assert rows[name].verdict.startswith(verdict)


def test_an_open_electron_path_does_not_exclude_a_model() -> None:
    f = np.geomspace(1e-2, 1e4, 50)
    z = 10 + 1 / (0.02 * (2j * np.pi * f) ** 0.8)
    found = identify(Spectrum("s", f, z * noisy_factor(50, 0.005, 0)))
    assert found.model == "cpe"
    assert "electron-path-open" in codes(found.findings)
    assert next(c for c in found.candidates if c.model == "cpe").against == ""
    assert found.actuator.material.cpe_exponent == pytest.approx(0.8, abs=0.01)


# -- what is not chosen ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(3))
def test_whatever_auto_takes_beyond_rc_is_determined(seed: int) -> None:
    r = record(step(), 60.0, 151, strip=two_branches(), noise=0.005, seed=seed)
    found = identify(r.measurement(), base=r.strip, engine="exact")
    assert found.model == "rc" or found.port.identifiability().determined


@pytest.fixture(scope="module")
def two_fits() -> dict[str, PortFit]:
    r = record(step(), 300.0, 151, strip=TWO, noise=1e-3, seed=5)
    return {model: fit_current(r, model, engine="exact") for model in ("rc", "rc2")}


Choose = Callable[[dict[str, PortFit]], tuple[str, selection.Candidate]]


@pytest.fixture
def choose(monkeypatch: pytest.MonkeyPatch) -> Choose:
    """The model that is chosen of these fits, and what becomes of rc2."""

    def chosen_among(fits: dict[str, PortFit]) -> tuple[str, selection.Candidate]:
        def fit(_: object, model: str, *__: object) -> PortFit:
            if model not in fits:
                raise SolveError("not among them")
            return fits[model]

        monkeypatch.setattr(selection, "fit_port", fit)
        port, candidates = selection.fit_best(fits["rc"].data, 0.0, frozenset(), None)
        return port.kind.name, next(c for c in candidates if c.model == "rc2")

    return chosen_among


def test_a_best_fit_that_is_not_determined_is_not_chosen_and_the_verdict_says_why(
    two_fits: dict[str, PortFit], choose: Choose, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert choose(two_fits)[0] == "rc2"
    genuine = PortFit.identifiability
    open_end = {"rank": 4, "open": ("capacitance_2 has no upper limit",)}
    monkeypatch.setattr(
        PortFit, "identifiability", lambda p, **_: replace(genuine(p), **(open_end if p.kind.name == "rc2" else {}))
    )
    model, candidate = choose(two_fits)
    assert model == "rc"
    assert "rank 4 of 5; profile open: capacitance_2 has no upper limit" in candidate.verdict
    entry = candidate.to_dict()["identifiability"]
    assert (entry["rank"], entry["determined"]) == (4, False)


def test_a_best_fit_reached_only_once_is_not_chosen(two_fits: dict[str, PortFit], choose: Choose) -> None:
    lucky = replace(two_fits["rc2"], fit=replace(two_fits["rc2"].fit, starts=StartSummary(15, 1)))
    model, candidate = choose(two_fits | {"rc2": lucky})
    assert model == "rc"
    assert "not reached a second time" in candidate.verdict


def test_a_second_branch_that_cannot_be_fitted_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    genuine = selection.fit_port

    def failing(given: object, model: str, *rest: object) -> PortFit:
        if model == "rc2":
            raise SolveError("ngspice stopped at 1 s of 2 s")
        return genuine(given, model, *rest)

    monkeypatch.setattr(selection, "fit_port", failing)
    found = identify(record(step(), 300.0, 301, strip=TWO, noise=1e-3).measurement(), base=TWO, engine="exact")
    (finding,) = (f for f in found.findings if f.code == "model-not-fitted")
    assert finding.values["model"] == "rc2"
    assert "ngspice stopped" in str(finding)


# -- what is said ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["step", "spectrum", "several"])
def test_an_undetermined_model_asked_for_is_given_with_a_warning(kind: str) -> None:
    """Records of one pole by a model of two; a spectrum of one pole by a model of diffusion."""
    short = [record(step(u), 30.0, 101, noise=0.003, seed=k).measurement() for k, u in ((46, 4.0), (47, 2.0))]
    if kind == "spectrum":
        name, found = "cpe_exponent", identify(spectrum_of_model("rc", 0.005), model="cpe", electrode_resistance=1.0)
    else:
        name, found = "capacitance_1", identify(short[: 1 + (kind == "several")], model="rc2", engine="exact")
    (finding,) = (f for f in found.findings if f.code == "not-determined")
    assert name in finding.values["reason"]
    assert "not determined by these data" in found.candidates[0].against
    assert found.statistics["identifiability"]["determined"] is False


def test_the_table_marks_the_chosen_model_and_says_what_is_against_others() -> None:
    found = identify(spectrum_of_model("rc2", 0.005), electrode_resistance=2.0)
    rows = [row for row in found.summary().splitlines() if row.startswith(("rc", "warburg", "cpe"))]
    assert [row.split()[0] for row in rows if row.endswith("chosen")] == ["rc2"]
    assert any(row.startswith("rc3") and "not determined" in row for row in rows)
    assert any(row.startswith("rc ") and "BIC higher than for" in row for row in rows)
