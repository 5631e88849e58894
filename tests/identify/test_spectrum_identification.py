"""From a spectrum to a strip: the right model chosen, everything told, files as promised, the command line."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from ilg_circuit.identify.spectrum_report import spectrum_table
from spectrum_texts import FORMATS
from test_spectrum_fit import TRUTHS, spectrum

from ilg_circuit.cli import main
from ilg_circuit.errors import InputError
from ilg_circuit.identify import Spectrum, identify_spectra, identify_spectrum
from ilg_circuit.strip.actuator import PAPER
from ilg_circuit.strip.elements import lumped_elements
from ilg_circuit.strip.file import load_actuator


@pytest.mark.parametrize("model", TRUTHS)
def test_auto_finds_the_model(model: str) -> None:
    for seed in (0, 1):
        found = identify_spectrum(spectrum(model, 0.005, seed), electrode_resistance=TRUTHS[model][1])
        assert found.model == model
        assert found.fit.undetermined == ()
        against = {c.model: c.against for c in found.candidates}
        assert tuple(against) == ("rc", "rc2", "rc3", "warburg", "cpe")
        if model == "rc":  # all others hold it as a limit, which nothing determines
            assert all(why for name, why in against.items() if name != "rc")


def test_an_open_electron_path_does_not_exclude_a_model() -> None:
    f = np.geomspace(1e-2, 1e4, 50)
    random = np.random.default_rng(0)
    z = 10 + 1 / (0.02 * (2j * np.pi * f) ** 0.8)
    z = z * (1 + 0.005 * (random.standard_normal(50) + 1j * random.standard_normal(50)))
    found = identify_spectrum(Spectrum("s", f, z))
    assert found.model == "cpe"
    assert found.fit.open_circuit
    assert next(c for c in found.candidates if c.model == "cpe").against == ""
    assert found.actuator.material.cpe_exponent == pytest.approx(0.8, abs=0.01)


def test_the_strip_has_the_fitted_port() -> None:
    found = identify_spectrum(spectrum("warburg", 0.003), model="warburg", electrode_resistance=2.0, base=PAPER)
    port = lumped_elements(found.actuator, (1e-3, 1e4)).port
    s = 2j * np.pi * found.spectrum.frequency
    assert port.impedance(s, ideal=True) == pytest.approx(found.fit.fitted, rel=1e-9)
    assert found.actuator.coupling == PAPER.coupling
    assert any("coupling was not fitted" in line for line in found.warnings)


def test_bad_points_are_left_out_and_named() -> None:
    good = spectrum("rc2", 0.003)
    z = good.impedance.copy()
    z[[15, 40]] *= 1.5
    found = identify_spectrum(replace(good, impedance=z), electrode_resistance=2.0)
    assert found.model == "rc2"
    assert list(found.fit.values.values()) == pytest.approx(TRUTHS["rc2"][0], rel=0.05)
    assert len(found.fit.spectrum.frequency) == len(good.frequency) - 2
    assert "2 of 61 points break the Kramers-Kronig relations" in found.warnings[0]
    assert len(found.to_json()["kramers_kronig"]["bad_frequencies_Hz"]) == 2


def test_json_is_the_contracts() -> None:
    found = identify_spectrum(spectrum("rc", 0.005), model="rc", electrode_resistance=1.0)
    data = json.loads(json.dumps(found.to_json(), allow_nan=False))
    assert data["model"] == "rc"
    assert set(data["parameters"]) == {"dc_resistance", "dynamic_resistance", "capacitance", "electrode_resistance"}
    entry = data["parameters"]["capacitance"]
    assert entry["unit"] == "F"
    assert entry["ci95"][0] < entry["value"] < entry["ci95"][1]
    assert entry["stderr"] > 0
    assert data["parameters"]["electrode_resistance"]["value"] == 1.0
    assert "three of four elements: held at the value given" in data["parameters"]["electrode_resistance"]["held"]
    statistics = data["statistics"]
    assert statistics["n"] == 122
    assert {"rmse", "aic", "bic", "relative_rms"} <= set(statistics)
    assert -1 <= data["correlations"]["dynamic_resistance, capacitance"] <= 1
    assert data["derived"]["time_constant"]["value"] == pytest.approx(6.8 * 0.02, rel=0.01)
    assert isinstance(data["warnings"], list)


def test_an_undetermined_model_asked_for_is_given_with_a_warning() -> None:
    found = identify_spectrum(spectrum("rc", 0.005), model="cpe", electrode_resistance=1.0)
    assert found.model == "cpe"
    assert any("not determined by this spectrum" in line and "cpe_exponent" in line for line in found.warnings)
    assert "not determined" in spectrum_table(found)


def test_errors() -> None:
    with pytest.raises(InputError, match="choose one of"):
        identify_spectrum(spectrum("rc"), model="rx")
    with pytest.raises(InputError, match="too large"):
        identify_spectrum(spectrum("rc"), electrode_resistance=100.0)


def test_a_spectrum_that_no_strip_has_is_not_passed_off_as_fitted() -> None:
    strange = Spectrum("s", np.geomspace(1, 10, 8), np.full(8, -1.0 - 1.0j))
    found = identify_spectrum(strange)
    assert found.fit.relative_rms > 0.3
    assert any("the model is not all that is there" in line for line in found.warnings)


def test_a_batch_goes_on_after_a_failure(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    good, bad = tmp_path / "good.csv", tmp_path / "bad.csv"
    good.write_text(FORMATS["CSV"]())
    bad.write_text("hello\n")
    found = identify_spectra([bad, good], ("rc", "rc2"), electrode_resistance=2.0)
    assert [(o.path.name, o.model, bool(o.result)) for o in found] == [
        ("bad.csv", "rc", False),
        ("bad.csv", "rc2", False),
        ("good.csv", "rc", True),
        ("good.csv", "rc2", True),
    ]
    assert "no column for frequency" in found[0].error
    assert found[3].result is not None
    assert found[3].result.fit.values["resistance_2"] == pytest.approx(100.0, rel=1e-5)
    assert capsys.readouterr().err == ""  # the bar is for terminals
    with pytest.raises(InputError, match="choose one of"):
        identify_spectra([good], ("rx",))


@pytest.mark.parametrize("name", ["CSV", "Gamry"])
def test_command(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    data = tmp_path / "strip.txt"
    data.write_text(FORMATS[name](), encoding="utf-8")
    out, as_json, plot = tmp_path / "f.toml", tmp_path / "f.json", tmp_path / "f.png"
    arguments = ["identify", str(data), "--electrode-resistance", "2ohm", "--model", "rc2"]
    with pytest.raises(SystemExit) as ended:
        main([*arguments, "--out", str(out), "--json", str(as_json), "--plot", str(plot)])
    assert not ended.value.code
    said = capsys.readouterr()
    assert "strip.txt: spectrum of 36 points, 10 mHz to 100 kHz; model rc2" in said.out
    assert "Traceback" not in said.err
    assert json.loads(as_json.read_text())["parameters"]["resistance_2"]["value"] == pytest.approx(100, rel=1e-4)
    fitted = load_actuator(str(out))
    branches = lumped_elements(fitted).port.branches
    assert branches[1] == pytest.approx((100.0, 0.02), rel=1e-4)
    assert plot.read_bytes().startswith(b"\x89PNG")
    assert "held" in out.read_text()


def test_command_refuses_a_bad_spectrum_in_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    data = tmp_path / "bad.csv"
    data.write_text("frequency_Hz,re_ohm,im_ohm\n1,2,-3\n")
    with pytest.raises(SystemExit) as ended:
        main(["identify", str(data)])
    assert ended.value.code == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err == "ilg-circuit: bad.csv: 1 point left, 6 are needed\n"


def test_table_marks_the_chosen_model_and_says_what_is_against_others() -> None:
    found = identify_spectrum(spectrum("rc2", 0.005), electrode_resistance=2.0)
    rows = spectrum_table(found).splitlines()
    assert sum(row.endswith("<- chosen") for row in rows) == 1
    assert next(row for row in rows if row.endswith("<- chosen")).startswith("rc2")
    assert any(row.startswith("rc3") and "not determined" in row for row in rows)


def test_what_impedance_writes_identify_reads(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    strip = replace(PAPER, coupling=None)
    from ilg_circuit.simulation.impedance import frequencies, impedance

    path = tmp_path / "z.csv"
    impedance(strip, frequencies(1e-4, 1e3, 50), engine="exact").write_csv(path)
    (found,) = identify_spectra([path], ("auto",), progress=False)
    assert found.result is not None
    assert found.result.model == "rc"
    port = lumped_elements(strip).port
    assert found.result.parameters["capacitance"].value == pytest.approx(port.capacitance, rel=1e-6)
    assert found.result.parameters["dc_resistance"].value == pytest.approx(port.dc_resistance, rel=1e-6)
