"""One pipeline for every kind of data: six differences between a record, a spectrum and several files stay mended."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command import Run
from kinds import KINDS, data, identified, write
from synthetic import Synthetic, record, spectrum, step, two_branches

from ilg_circuit.errors import SolveError
from ilg_circuit.findings import codes
from ilg_circuit.fit import selection as fit_selection
from ilg_circuit.fit.selection import EVIDENCE
from ilg_circuit.identification import Identification, coupling_fit, identify, selection
from ilg_circuit.measurements.record import Record
from ilg_circuit.measurements.spectrum import Spectrum
from ilg_circuit.strip.actuator import PAPER
from ilg_circuit.strip.file import load_actuator

pytestmark = pytest.mark.usefixtures("drafts")
RC = ("--model", "rc", "--engine", "exact", "--actuator", "paper", "--onset", "first-level")


# -- F1: a spectrum's strip has its uncertainty ------------------------------------------------------------------------


@pytest.mark.parametrize("kind", KINDS)
def test_every_fitted_strip_is_simulated_with_its_band(kind: str, run: Run, tmp_path: Path) -> None:
    files = write(kind, tmp_path)
    assert run("identify", *files, *RC, "--out", "f.toml").code == 0
    assert "[uncertainty]" in Path("f.toml").read_text()
    uncertainty = load_actuator("f.toml").uncertainty
    assert uncertainty is not None
    assert {"dc_resistance", "dynamic_resistance", "capacitance"} <= set(uncertainty.names)
    how = ("--drive", "step:4V", "--duration", "100s", "--samples", "21", "--engine", "exact", "--beam", "static")
    done = run("simulate", "f.toml", *how, "--band", "--out", "band.csv")
    assert done.code == 0, done.err
    assert "current_stderr" in Path("band.csv").read_text().splitlines()[0]


# -- F2: what is found of a displacement is found of it among others too -----------------------------------------------


def strayed(voltage: float, seed: int) -> Synthetic:
    """A displacement that wanders off as no d(s), and no straight line beside it, does."""
    r = record(step(voltage), 300.0, 151, rest=20, displacement=True, noise=3e-3, seed=seed)
    t = (r.columns["time"] - r.columns["time"][20]) / 300
    away = 6e-4 * np.sign(voltage) * np.sin(2 * np.pi * 25 * t) * (t > 0)
    return r.changed(displacement=r.columns["displacement"] + away)


def about_displacements(found: Identification) -> set[str]:
    return {code for code in codes(found.findings) if code.startswith("displacement")}


def test_a_finding_on_a_displacement_does_not_depend_on_other_files() -> None:
    odd = strayed(4.0, 1).measurement("odd.csv")
    alone = identify(odd, base=PAPER, model="rc", engine="exact", law="ec31")
    assert about_displacements(alone) & {"displacement-not-described", "displacement-autocorrelated"}
    for others in (data("step"), data("spectrum")):
        together = identify([odd, *others], base=PAPER, model="rc", engine="exact", law="ec31")
        assert about_displacements(alone) <= about_displacements(together)
        assert {f.subject for f in together.findings if f.code.startswith("displacement")} == {"odd.csv"}


def test_a_reversed_camera_and_a_drift_are_said_of_each_file() -> None:
    files = [
        record(step(u), 150.0, 151, rest=20, displacement=True, noise=3e-3, axis=-1.0, drift=drift, seed=k).measurement(
            f"{k}.csv"
        )
        for k, (u, drift) in enumerate(((4.0, 0.0), (-2.0, 3e-6)))
    ]
    alone = [identify(file, base=PAPER, model="rc", engine="exact") for file in files]
    together = identify(files, base=PAPER, model="rc", engine="exact")
    for file, found in zip(files, alone, strict=True):
        of_file = {f.code for f in together.findings if f.subject.startswith(file.source)}
        assert of_file - {"coupling-not-fitted"} == codes(found.findings)
    assert "displacement-axis-reversed" in about_displacements(alone[0])
    assert "displacement-drifts" in about_displacements(alone[1])


# -- F3: displacements that cannot be fitted together ------------------------------------------------------------------


def test_displacements_that_no_coupling_holds_for_leave_the_port(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(*_: object, **__: object) -> None:
        raise SolveError("the fit did not converge in 200 evaluations")

    files = write("several", tmp_path)
    expected = identified("several").parameters["capacitance"].value
    monkeypatch.setattr(coupling_fit, "fit", fails)
    done = run("identify", *files, *RC, "--out", "f.toml", "--json", "fit.json")
    assert done.code == 0, done.err
    content = json.loads(Path("fit.json").read_text())
    assert content["parameters"]["capacitance"]["value"] == pytest.approx(expected, rel=1e-6)
    assert "coupling_gain" not in content["parameters"]
    (finding,) = (f for f in content["findings"] if f["code"] == "displacements-inconsistent")
    assert "displacement" in finding["text"]
    assert "did not converge" in finding["text"]
    assert f"warning: {finding['text']}" in done.err.splitlines()


def test_files_keep_their_own_coupling_where_the_joint_fit_fails(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    true, calls = coupling_fit.fit, iter((True,))

    def fails_at_first(*given: Any, **how: Any) -> Any:
        if next(calls, False):
            raise SolveError("the fit did not converge in 200 evaluations")
        return true(*given, **how)

    files = write("several", tmp_path)
    monkeypatch.setattr(coupling_fit, "fit", fails_at_first)
    done = run("identify", *files, *RC, "--out", "f.toml", "--json", "fit.json")
    assert done.code == 0, done.err
    content = json.loads(Path("fit.json").read_text())
    assert {"displacements-inconsistent", "displacements-apart"} <= {f["code"] for f in content["findings"]}
    for name in ("coupling_gain", "coupling_zero", "coupling_damping_ratio", "coupling_natural_frequency"):
        own = [found[name]["value"] for found in content["own"].values() if name in found]
        assert len(own) == len(set(own)) > 1
        assert content["parameters"][name]["value"] == pytest.approx(np.exp(np.mean(np.log(own))))
    assert load_actuator("f.toml").coupling is not None


def test_displacements_of_different_gels_are_no_failure(run: Run, tmp_path: Path) -> None:
    """The port of all files is given, whatever becomes of d(s), and what is wrong with it is said."""
    k = PAPER.coupling
    assert k is not None
    other = replace(PAPER, coupling=replace(k, natural_frequency=20 * k.natural_frequency, damping_ratio=3.0))
    for name, strip, voltage in (("a", PAPER, 4.0), ("b", other, 2.0)):
        made = record(step(voltage), 150.0, 151, strip=strip, rest=20, displacement=True, noise=3e-3, seed=ord(name))
        made.write(tmp_path / f"{name}.csv")
    done = run("identify", "a.csv", "b.csv", *RC, "--json", "fit.json")
    assert done.code == 0, done.err
    content = json.loads(Path("fit.json").read_text())
    assert content["parameters"]["capacitance"]["value"] == pytest.approx(0.35, rel=0.02)
    assert any(f["code"].startswith(("displacement", "file")) for f in content["findings"]), content["findings"]


# -- F4: one schema ----------------------------------------------------------------------------------------------------


def keys(entries: list[dict[str, Any]]) -> set[frozenset[str]]:
    return {frozenset(entry) for entry in entries}


@pytest.mark.parametrize("model", ["rc", "auto"])
def test_fit_json_has_one_schema(model: str) -> None:
    contents = [identified(kind, model).to_dict() for kind in KINDS]
    assert len(keys(contents)) == 1
    assert len(keys([c for content in contents for c in content["candidates"]])) == 1
    assert len(keys([r for content in contents for r in content["records"]])) == 1
    for kind, content in zip(KINDS, contents, strict=True):
        assert len(content["records"]) == {"step": 2, "waveform": 2, "spectrum": 1, "several": 5}[kind]
        assert content["correlations"]
        assert {"aic", "starts", "starts_agreeing", "identifiability"} <= set(content["statistics"])
        assert content["source"]


# -- F5: one judgement -------------------------------------------------------------------------------------------------


def _two_branches(kind: str) -> list[Record | Spectrum]:
    made = record(step(), 60.0, 151, strip=two_branches(), noise=0.005, seed=1)
    back = record(step(-2.0), 60.0, 151, strip=two_branches(), noise=0.005, seed=2)
    z = spectrum(two_branches(), 1e-2, 1e2, noise=0.01)
    files = {
        "step": [made.measurement()],
        "spectrum": [z],
        "several": [made.measurement("a"), back.measurement("b"), z],
    }
    return list(files[kind])


@pytest.mark.parametrize("kind", ["step", "spectrum", "several"])
def test_a_candidate_is_not_both_determined_and_not(kind: str) -> None:
    found = identify(_two_branches(kind), base=PAPER, engine="exact")
    judged = [c for c in (*found.candidates, *identified(kind, "auto").candidates) if c.identifiability is not None]
    assert any(not c.identifiability.determined for c in judged if c.identifiability), "or there is nothing to be seen"
    for c in judged:
        assert c.identifiability is not None
        assert c.identifiability.determined != ("not determined" in c.against)
        if not c.identifiability.determined:
            assert c.identifiability.reason in c.against
            assert not c.chosen or all(other.against for other in found.candidates)


# -- F6: the same options and rules ------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", KINDS)
def test_profiles_for_every_kind(kind: str) -> None:
    found = identify(data(kind), base=PAPER, model="rc", engine="exact", intervals="profile")
    for p in found.parameters.values():
        if p.fixed_because:
            continue
        assert p.method == "profile"
        assert p.ci95_profile is not None
        low, high = p.ci95_profile
        assert low < p.value < high
        assert p.ci95 is not None
        assert high - low == pytest.approx(p.ci95[1] - p.ci95[0], rel=0.15)


def test_an_engine_that_has_no_effect_is_said(run: Run, tmp_path: Path) -> None:
    (file,) = write("spectrum", tmp_path)
    how = ("identify", file, "--model", "rc", "--json", "fit.json")
    said = [run(*how, *engine).err for engine in ((), ("--engine", "exact"))]
    assert "--engine" not in said[0]
    assert "--engine has no effect" in said[1]
    mixed = run("identify", *write("several", tmp_path), *RC)
    assert "--engine" not in mixed.err


@pytest.mark.parametrize("kind", ["step", "spectrum", "several"])
@pytest.mark.parametrize(("gain", "model"), [(EVIDENCE - 0.1, "rc"), (EVIDENCE + 0.1, "rc2")])
def test_auto_asks_for_the_same_evidence(kind: str, gain: float, model: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where a second branch is better by a little less than 10 BIC one is enough, where by a little more it is not."""
    monkeypatch.setattr(selection, "_bic", lambda found, samples: {"rc": gain, "rc2": 0.0}.get(found.kind.name, 100.0))
    monkeypatch.setattr(fit_selection, "CLEAR", np.inf)  # by the BIC alone
    monkeypatch.setattr(selection, "model_names", lambda: ("rc", "rc2"))
    assert EVIDENCE == 10
    strip = replace(two_branches(), coupling=None)
    files = [record(step(u), 300.0, 151, strip=strip, noise=1e-3, seed=5).measurement(f"{u}") for u in (4.0, -2.0)]
    z = spectrum(strip, 1e-4, 1e2)
    given = {"step": files[:1], "spectrum": [z], "several": [*files, z]}[kind]
    assert identify(given, base=strip, engine="exact").model == model


def test_own_and_bias_for_one_file(run: Run, tmp_path: Path) -> None:
    """A parameter of its own changes nothing where there is one file."""
    (file,) = write("spectrum", tmp_path)
    texts = []
    for own in ((), ("--own", "capacitance")):
        done = run("identify", file, *RC[:2], *own, "--bias", "0.1V", "--json", "fit.json")
        assert done.code == 0, done.err
        texts.append(json.loads(Path("fit.json").read_text())["parameters"]["capacitance"]["value"])
    assert texts[0] == pytest.approx(texts[1], rel=1e-9)
