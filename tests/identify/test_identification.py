"""What comes out: parameters, derived quantities, JSON, TOML, text, and the command line that writes them."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from ilg_circuit.identify.report import plot_identification, table, write_actuator, write_json
from scipy.stats import t as student
from synthetic import Synthetic, drives, record, step, two_branches

from ilg_circuit.cli import main
from ilg_circuit.fit.criteria import autocorrelation, effective_samples, structured
from ilg_circuit.identify import Identification, identify
from ilg_circuit.simulation import closed_forms as formulas
from ilg_circuit.strip.actuator import PAPER
from ilg_circuit.strip.elements import lumped_elements
from ilg_circuit.strip.file import load_actuator, save_actuator

COUPLING = {"coupling_gain", "coupling_zero", "coupling_damping_ratio", "coupling_natural_frequency"}


# -- the result --------------------------------------------------------------------------------------------------------


def test_the_actuator_answers_as_the_fit_says(step_fit: Identification) -> None:
    lumped = lumped_elements(step_fit.actuator)
    values = {name: p.value for name, p in step_fit.parameters.items()}
    assert lumped.dc_resistance == pytest.approx(values["dc_resistance"], rel=1e-12)
    assert lumped.branches[0] == pytest.approx((values["dynamic_resistance"], values["capacitance"]), rel=1e-12)
    assert lumped.electrode_resistance == values["electrode_resistance"] == 0.0
    k = step_fit.actuator.coupling
    assert k is not None
    assert (k.gain, k.zero) == (values["coupling_gain"], values["coupling_zero"])
    assert step_fit.actuator.geometry == PAPER.geometry
    assert step_fit.actuator.material.youngs_modulus == PAPER.material.youngs_modulus


def test_intervals_are_student_s(step_fit: Identification) -> None:
    for name, p in step_fit.parameters.items():
        if name == "electrode_resistance":
            assert p.stderr is None
            assert "held" in p.held
            continue
        assert p.stderr is not None
        assert p.ci95 is not None
        # symmetric about the logarithm
        assert p.ci95[0] * p.ci95[1] == pytest.approx(p.value**2)
        n = step_fit.statistics["displacement"]["n"] if name in COUPLING else step_fit.statistics["n"]
        half = np.log(p.ci95[1] / p.value) * p.value / p.stderr
        assert half == pytest.approx(student.ppf(0.975, n - 4), rel=1e-3)


def test_derived_quantities_follow(step_fit: Identification) -> None:
    d = {name: p.value for name, p in step_fit.derived.items()}
    p = {name: p.value for name, p in step_fit.parameters.items()}
    assert (d["onset"], d["step_voltage"]) == (20.0, 4.0)
    expected = formulas.current_constants(p["dc_resistance"], p["dynamic_resistance"], p["capacitance"])
    assert (d["steady_conductance"], d["transient_conductance"], d["rate"]) == pytest.approx(expected)
    assert d["time_constant"] == pytest.approx(p["dynamic_resistance"] * p["capacitance"])
    static = p["coupling_gain"] * p["coupling_zero"] / p["coupling_natural_frequency"] ** 2
    assert d["displacement_per_volt"] == pytest.approx(static * lumped_elements(PAPER).bending_ratio)
    assert d["displacement_window"] == 300.0


def test_per_volt_quantities_do_not_depend_on_what_was_held(step_record: Synthetic, step_fit: Identification) -> None:
    held = identify(
        step_record.changed(displacement=None).measurement(), base=PAPER, model="rc", electrode_resistance=5.0
    )
    for name in ("steady_conductance", "transient_conductance", "rate"):
        assert held.derived[name].value == pytest.approx(step_fit.derived[name].value, rel=1e-6)
    assert held.parameters["electrode_resistance"].value == 5.0
    assert lumped_elements(held.actuator).electrode_resistance == pytest.approx(5.0)


def test_re_of_the_given_actuator_is_held() -> None:
    material = replace(PAPER.material, electrode_resistivity_1=175.0, electrode_thickness_1=2e-6)
    strip = replace(PAPER, material=material)
    m = record(step(), 300.0, 201, strip=strip, noise=1e-3).measurement()
    found = identify(m, base=strip, model="rc")
    assert found.parameters["electrode_resistance"].value == pytest.approx(2.0)
    assert found.parameters["dynamic_resistance"].value == pytest.approx(19.4363, rel=0.005)
    none = identify(m, base=strip, model="rc", electrode_resistance=0.0)
    assert none.parameters["electrode_resistance"].value == 0.0


def test_without_a_displacement_the_given_coupling_stays_and_is_said() -> None:
    m = record(step(), 300.0, 201, noise=1e-3).measurement()
    found = identify(m, base=PAPER, model="rc")
    assert found.actuator.coupling == PAPER.coupling
    assert any("coupling was not fitted" in w for w in found.warnings)
    assert not COUPLING & set(found.parameters)
    assert identify(m, model="rc").actuator.coupling is None


def test_assumed_geometry_is_said(step_record: Synthetic) -> None:
    found = identify(step_record.measurement(), model="rc", engine="exact")
    assert any("no --actuator given" in w and "b^2/L_F^2" in w for w in found.warnings)


def test_warnings_are_not_repeated() -> None:
    found = identify(record(step(), 300.0, 301, strip=two_branches(), noise=1e-3, seed=1).measurement(), model="rc")
    assert len(set(found.warnings)) == len(found.warnings)


def test_progress_is_counted() -> None:
    calls: list[int] = []
    m = record(step(), 300.0, 101, noise=1e-3).measurement()
    found = identify(m, model="rc", progress=lambda: calls.append(1))
    assert len(calls) == found.statistics["evaluations"] > 1


# -- correlations ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("model", ["rc", "rc2"])
def test_correlations_are_correlations(model: str) -> None:
    m = record(step(), 300.0, 301, strip=two_branches(), noise=1e-3, seed=2).measurement()
    found = identify(m, model=model)
    matrix = found.current.fit.correlations()
    assert np.diag(matrix) == pytest.approx(1.0)
    assert matrix == pytest.approx(matrix.T)
    assert (np.abs(matrix) <= 1 + 1e-12).all()
    assert np.linalg.eigvalsh(matrix).min() > 0
    names = found.current.fit.names
    assert set(found.correlations) == {f"{a}, {b}" for k, a in enumerate(names) for b in names[k + 1 :]}
    assert all(-1 <= value <= 1 for value in found.correlations.values())


def test_correlations_hold_both_fits(step_fit: Identification) -> None:
    assert len(step_fit.correlations) == 3 + 6
    assert all(-1 <= value <= 1 for value in step_fit.correlations.values())
    assert step_fit.correlations["coupling_gain, coupling_zero"] < -0.9


# -- files -------------------------------------------------------------------------------------------------------------


def test_json_has_the_contract_s_keys(step_fit: Identification, tmp_path: Path) -> None:
    write_json(step_fit, tmp_path / "fit.json")
    content = json.loads((tmp_path / "fit.json").read_text(), parse_constant=lambda name: pytest.fail(name))
    assert {"model", "parameters", "derived", "statistics", "warnings"} <= set(content)
    assert content["model"] == "rc"
    assert {"dc_resistance", "dynamic_resistance", "capacitance", "electrode_resistance"} | COUPLING == set(
        content["parameters"]
    )
    units = {name: p["unit"] for name, p in content["parameters"].items()}
    assert units["dc_resistance"] == units["dynamic_resistance"] == units["electrode_resistance"] == "ohm"
    assert units["capacitance"] == "F"
    assert units["coupling_gain"] == "m/(V s)"
    for name, p in content["parameters"].items():
        assert {"value", "stderr", "unit", "ci95"} <= set(p)
        if name != "electrode_resistance":
            low, high = p["ci95"]
            assert low < p["value"] < high
    assert {"rmse", "aic", "bic", "n"} <= set(content["statistics"])
    assert content["statistics"]["n"] == 301
    assert all(isinstance(w, str) for w in content["warnings"])
    assert content["parameters"]["capacitance"]["value"] == step_fit.parameters["capacitance"].value


def test_json_of_two_branches_names_them_by_number() -> None:
    m = record(step(), 300.0, 301, strip=two_branches(), noise=1e-3, seed=3).measurement()
    content = identify(m, model="rc2").to_json()
    names = ["dc_resistance", "resistance_1", "capacitance_1", "resistance_2", "capacitance_2", "electrode_resistance"]
    assert list(content["parameters"]) == names
    assert content["derived"]["time_constant_1"]["value"] < content["derived"]["time_constant_2"]["value"]


def test_toml_loads_back_to_the_fitted_strip(step_fit: Identification, tmp_path: Path) -> None:
    path = tmp_path / "fitted.toml"
    write_actuator(step_fit, path)
    assert load_actuator(path) == step_fit.actuator
    comments = [line for line in path.read_text().splitlines() if line.startswith("#")]
    assert any("record.csv" in line and "model rc" in line for line in comments)
    assert any("dc_resistance" in line and "+-" in line for line in comments)


def test_toml_of_two_branches_loads_back(tmp_path: Path) -> None:
    m = record(step(), 300.0, 301, strip=two_branches(), noise=1e-3, seed=3).measurement()
    found = identify(m, model="rc2", electrode_resistance=1.0)
    write_actuator(found, tmp_path / "fitted.toml")
    again = load_actuator(tmp_path / "fitted.toml")
    assert again == found.actuator
    assert np.array(lumped_elements(again).branches) == pytest.approx(np.array(found.current.branches))


def test_the_table_holds_every_number(step_fit: Identification) -> None:
    text = table(step_fit)
    for name in (*step_fit.parameters, *step_fit.derived):
        assert name in text
    assert "standard error" in text
    assert "95 % interval" in text
    assert "nan" not in text.lower()


@pytest.mark.parametrize("kind", ["step", "sine"])
def test_the_picture(step_fit: Identification, tmp_path: Path, kind: str) -> None:
    found = step_fit
    if kind == "sine":
        found = identify(record(drives(4.0)["sine"], 300.0, 301, rest=20, noise=1e-3).measurement(), model="rc")
    plot_identification(found, tmp_path / "fit.png")
    assert (tmp_path / "fit.png").read_bytes().startswith(b"\x89PNG")


# -- the command -------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Outcome:
    code: int
    out: str
    err: str


Run = Callable[..., Outcome]


@pytest.fixture
def run(capfd: pytest.CaptureFixture[str]) -> Run:
    def of(*arguments: str | Path) -> Outcome:
        with pytest.raises(SystemExit) as stop:
            main([str(a) for a in arguments])
        out, err = capfd.readouterr()
        return Outcome(int(stop.value.code or 0), out, err)

    return of


def test_the_command_writes_what_it_is_asked_for(run: Run, step_record: Synthetic, tmp_path: Path) -> None:
    units = {"time": ("ms", 1e3), "current": ("mA", 1e3), "displacement": ("mm", 1e3)}
    data = step_record.write(tmp_path / "data.csv", units)
    save_actuator(replace(PAPER, name="mine"), tmp_path / "mine.toml")
    outputs = {name: tmp_path / name for name in ("fitted.toml", "fit.json", "fit.png")}
    result = run(
        "identify", data, "--actuator", tmp_path / "mine.toml", "--out", outputs["fitted.toml"],
        "--json", outputs["fit.json"], "--plot", outputs["fit.png"], "--electrode-resistance", "1ohm", "--model", "rc",
    )  # fmt: skip
    assert result.code == 0, result.err
    assert result.err == ""
    assert all(path.stat().st_size > 100 for path in outputs.values())
    content = json.loads(outputs["fit.json"].read_text())
    strip = load_actuator(outputs["fitted.toml"])
    assert strip.name == "data"
    assert lumped_elements(strip).dc_resistance == pytest.approx(content["parameters"]["dc_resistance"]["value"])
    assert content["parameters"]["electrode_resistance"]["value"] == 1.0
    assert content["engine"] == "ngspice"
    assert "dc_resistance" in result.out
    assert sorted(p.name for p in tmp_path.iterdir()) == sorted(["data.csv", "mine.toml", *outputs])


def test_the_command_s_exact_engine_and_warnings_on_stderr(run: Run, tmp_path: Path) -> None:
    data = record(step(), 300.0, 201, strip=two_branches(), noise=1e-3).write(tmp_path / "data.csv")
    result = run("identify", data, "--engine", "exact", "--model", "rc")
    assert result.code == 0
    lines = result.err.splitlines()
    assert lines
    assert all(line.startswith("warning: ") for line in lines)
    assert "exact in the loop" in result.out


GOOD = ["time_s,voltage_V,current_A", *(f"{k},{4 * (k > 3)},{(k > 3) * 0.2 * math.exp(-k / 9)}" for k in range(40))]


def broken(**lines: str) -> str:
    """GOOD with some lines replaced, by their number."""
    text = list(GOOD)
    for number, line in lines.items():
        text[int(number[1:])] = line
    return "\n".join(text)


BAD = {
    "empty": ("", "the file is empty"),
    "blank lines": ("\n \n\n", "the file is empty"),
    "header only": (GOOD[0], "no row of numbers"),
    "one row": ("\n".join(GOOD[:2]), "fewer than two numbers"),
    "two rows": ("\n".join(GOOD[:3]), "zero throughout"),
    "no header": ("\n".join(GOOD[1:]), "no column for"),
    "no units": (broken(L0="time,voltage,current"), "has no unit"),
    "wrong unit": (broken(L0="time_s,voltage_m,current_A"), "does not measure this quantity"),
    "unknown unit": (broken(L0="time_s,voltage_V,current_foo"), "unknown unit 'foo'"),
    "no voltage": (broken(L0="time_s,torque_Nm,current_A"), "no column for voltage; not understood: 'torque_Nm'"),
    "no current": (broken(L0="time_s,voltage_V,Strom_A"), "no column for current; not understood: 'Strom_A'"),
    "two currents": (broken(L0="time_s,current_mA,current_A"), "both give the current"),
    "text": (broken(L10="9,4,OVLD"), "line 11, column 'current_A': 'OVLD' is not a number"),
    "infinite": (broken(L10="9,4,inf"), "'inf' is not a number"),
    "repeated time": (broken(L10="8,4,0.1"), "line 11: time 8 s repeats 8 s"),
    "time goes back": (broken(L10="2,4,0.1"), "goes back from"),
    "no time": (broken(L10=",4,0.1"), "line 11 has no time"),
    "too many cells": (broken(L10="9,4,0.1,7"), "has 4 cells, the header 3"),
    "decimal commas": (broken(L10='9,4,"0,1"'), "'0,1' is not a number"),
    "row of units": (broken(L1="s,V,A"), "'s' is not a number"),
    "binary": ("time_s,voltage_V,current_A\n\0\0\0,1,2", "not a text file"),
    "all current blank": ("\n".join([GOOD[0], *(f"{k},{4 * (k > 3)},NaN" for k in range(40))]), "has no number"),
    "zero volts": ("\n".join([GOOD[0], *(f"{k},0,{k}" for k in range(40))]), "zero throughout"),
    "constant": ("\n".join([GOOD[0], *(f"{k},4,0.01" for k in range(40))]), "no step in the record"),
    "resistor": ("\n".join([GOOD[0], *(f"{k},{4 * (k > 3)},{0.01 * (k > 3)}" for k in range(40))]), "no step"),
    "no current at all": ("\n".join([GOOD[0], *(f"{k},{4 * (k > 3)},0" for k in range(40))]), "no step"),
    "wires swapped": (
        "\n".join([GOOD[0], *(f"{k},{-4 * (k > 3)},{(k > 3) * math.exp(-k / 9)}" for k in range(40))]),
        "does not follow the voltage",
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_files_end_in_one_line_and_nothing_is_written(run: Run, tmp_path: Path, name: str) -> None:
    text, reason = BAD[name]
    data = tmp_path / "data.csv"
    data.write_text(text)
    outputs = ["--out", tmp_path / "a.toml", "--json", tmp_path / "a.json", "--plot", tmp_path / "a.png"]
    result = run("identify", data, *outputs)
    assert result.code == 2
    assert result.out == ""
    assert len(result.err.splitlines()) == 1
    assert result.err.startswith("ilg-circuit: ")
    assert reason in result.err
    assert [p.name for p in tmp_path.iterdir()] == ["data.csv"]


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        (["--electrode-resistance", "2"], "has no unit"),
        (["--electrode-resistance", "500ohm"], "is too large"),
        (["--electrode-resistance", "-1ohm"], "must be zero or more"),
        (["--model", "rc9"], "model is 'rc9'; choose one of"),
        (["--engine", "gnucap"], "'gnucap' is not one of"),
        (["--actuator", "nowhere.toml"], "no actuator 'nowhere.toml'"),
        (["--out", "nowhere/x.toml"], "does not exist"),
        (["--json", "."], "is a folder"),
        (["--plot", "x.txt"], "end its name in"),
    ],
)
def test_bad_options_end_in_one_line(run: Run, tmp_path: Path, options: list[str], reason: str) -> None:
    data = tmp_path / "data.csv"
    data.write_text("\n".join(GOOD))
    result = run("identify", data, *options)
    assert result.code == 2
    assert len(result.err.splitlines()) == 1
    assert reason in result.err
    assert [p.name for p in tmp_path.iterdir()] == ["data.csv"]


@pytest.mark.parametrize("name", ["nowhere.csv", "."])
def test_no_file(run: Run, tmp_path: Path, name: str) -> None:
    result = run("identify", tmp_path / name)
    assert result.code == 2
    assert "cannot read" in result.err


@pytest.mark.parametrize(
    "style",
    ["semicolons", "decimal commas", "tabs", "windows", "byte order mark", "comments", "quotes", "brackets"],
)
def test_every_style_of_csv_gives_the_same(run: Run, tmp_path: Path, style: str) -> None:
    text = record(step(), 300.0, 61, rest=3, noise=1e-3).write(tmp_path / "plain.csv").read_text()
    styles = {
        "semicolons": text.replace(",", ";"),
        "decimal commas": text.replace(",", ";").replace(".", ","),
        "tabs": text.replace(",", "\t"),
        "windows": text.replace("\n", "\r\n"),
        "byte order mark": "\ufeff" + text,
        "comments": "# potentiostat 7\n# 2026-11-22\n" + text,
        "quotes": "\n".join('"' + line.replace(",", '","') + '"' for line in text.splitlines()),
        "brackets": text.replace("time_s,voltage_V,current_A", "Time [s],U/V,Current (A)"),
    }
    (tmp_path / "styled.csv").write_bytes(styles[style].encode())
    outcomes = [
        run("identify", tmp_path / f"{name}.csv", "--engine", "exact", "--model", "rc") for name in ("plain", "styled")
    ]
    assert [o.code for o in outcomes] == [0, 0]
    assert outcomes[0].out.replace("plain", "styled") == outcomes[1].out


# -- residuals ---------------------------------------------------------------------------------------------------------


def test_white_residuals_have_no_structure_and_smooth_ones_do() -> None:
    random = np.random.default_rng(7)
    white = random.standard_normal(1000)
    assert not structured(white)
    assert effective_samples(white) == pytest.approx(1000, rel=0.15)
    smooth = np.convolve(white, np.ones(20) / 20, mode="same")
    assert structured(smooth)
    assert autocorrelation(smooth) > 0.9
    assert effective_samples(smooth) < 100
    assert autocorrelation(np.zeros(10)) == 0.0
    assert not structured(np.zeros(10))
