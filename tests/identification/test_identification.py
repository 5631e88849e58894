"""What comes out of any kind of data: parameters, derived quantities, correlations, JSON, TOML, text, pictures."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from kinds import KINDS, data, identified
from scipy.stats import t as student
from synthetic import Synthetic, record, spectrum, step, two_branches

from ilg_circuit.errors import InputError
from ilg_circuit.findings import codes
from ilg_circuit.fit.criteria import autocorrelation, effective_samples, structured
from ilg_circuit.identification import Identification, identify
from ilg_circuit.report.axes import save
from ilg_circuit.report.identification import write_actuator
from ilg_circuit.simulation import closed_forms as formulas
from ilg_circuit.strip.actuator import PAPER, Actuator
from ilg_circuit.strip.elements import lumped_elements
from ilg_circuit.strip.file import load_actuator

PORT = ("dc_resistance", "dynamic_resistance", "capacitance")
COUPLING = ("coupling_gain", "coupling_zero", "coupling_damping_ratio", "coupling_natural_frequency")
UNITS = dict(zip((*PORT, "electrode_resistance", *COUPLING), ("ohm", "ohm", "F", "ohm", "m/(V s)", "1/s", "", "rad/s"),
                 strict=True))  # fmt: skip
RECORDS = ("step", "waveform", "several")


@pytest.fixture(params=KINDS)
def kind(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture
def found(kind: str) -> Identification:
    return identified(kind)


def truth(strip: Actuator = PAPER) -> dict[str, float]:
    lumped, k = lumped_elements(strip), strip.coupling
    assert k is not None
    values = (lumped.port.dc_resistance, lumped.port.dynamic_resistance, lumped.port.capacitance, 0.0)
    return dict(zip(UNITS, (*values, k.gain, k.zero, k.damping_ratio, k.natural_frequency), strict=True))


# -- values and errors -------------------------------------------------------------------------------------------------


def test_the_truth_lies_within_the_errors(kind: str, found: Identification) -> None:
    expected = truth()
    assert set(found.parameters) == set(expected) - (set() if kind in RECORDS else set(COUPLING))
    for name, p in found.parameters.items():
        if name == "electrode_resistance":
            assert p.stderr is None
            assert "held" in p.fixed_because
            continue
        assert p.stderr is not None
        assert abs(p.value - expected[name]) < 4 * p.stderr
        assert p.stderr < 0.05 * p.value
    assert codes(found.findings) == (set() if kind in RECORDS else {"coupling-not-fitted"})


def test_the_actuator_answers_as_the_fit_says(kind: str, found: Identification) -> None:
    lumped = lumped_elements(found.actuator)
    values = {name: p.value for name, p in found.parameters.items()}
    assert lumped.port.dc_resistance == pytest.approx(values["dc_resistance"], rel=1e-12)
    assert lumped.port.branches[0] == pytest.approx((values["dynamic_resistance"], values["capacitance"]), rel=1e-12)
    assert lumped.port.electrode_resistance == values["electrode_resistance"] == 0.0
    k = found.actuator.coupling
    assert k is not None
    if kind in RECORDS:
        assert (k.gain, k.zero) == (values["coupling_gain"], values["coupling_zero"])
    else:
        assert k == PAPER.coupling
    assert found.actuator.geometry == PAPER.geometry
    assert found.actuator.material.youngs_modulus == PAPER.material.youngs_modulus


def test_intervals_are_student_s(kind: str, found: Identification) -> None:
    for name, p in found.parameters.items():
        if p.stderr is None:
            continue
        assert p.ci95 is not None
        assert p.ci95[0] * p.ci95[1] == pytest.approx(p.value**2), "symmetric about the logarithm"
        part = next(part for part in found.fit.parts if name in part.labels)
        half = np.log(p.ci95[1] / p.value) * p.value / p.stderr
        freedom = part.freedom[part.labels.index(name)]
        assert half == pytest.approx(student.ppf(0.975, freedom), rel=1e-3)
        if kind != "several":
            assert freedom == pytest.approx(len(part.residuals) - part.count)


def test_derived_quantities_follow(kind: str, found: Identification) -> None:
    d = {name: p.value for name, p in found.derived.items()}
    p = {name: p.value for name, p in found.parameters.items()}
    expected = formulas.current_constants(*(p[name] for name in PORT))
    assert (d["steady_conductance"], d["transient_conductance"], d["rate"]) == pytest.approx(expected)
    assert d["time_constant"] == pytest.approx(p["dynamic_resistance"] * p["capacitance"])
    assert d["steady_resistance"] == pytest.approx(p["dc_resistance"])
    assert d["high_frequency_resistance"] == pytest.approx(1 / (1 / p["dc_resistance"] + 1 / p["dynamic_resistance"]))
    files = [{name: p.value for name, p in o.derived.items()} for o in found.observations]
    for o, of in zip(found.observations, files, strict=True):
        assert set(of) <= set(d) or not found.single
        if o.quantity == "current":
            assert of["onset"] in (20.0, 40.0)
            assert ("step_voltage" in of) == (kind != "waveform")
            assert abs(of["current_offset"]) < 3e-4
        elif o.quantity == "displacement":
            static = p["coupling_gain"] * p["coupling_zero"] / p["coupling_natural_frequency"] ** 2
            assert of["displacement_per_volt"] == pytest.approx(static * lumped_elements(PAPER).bending_ratio)
            assert of["displacement_window"] == o.abscissa[-1]
        else:
            assert (of["lowest_frequency"], of["highest_frequency"]) == pytest.approx((1e-3, 1e2))
    if kind == "step":
        assert (d["onset"], d["step_voltage"]) == (40.0, 4.0)
        assert d["rest_position"] == pytest.approx(5e-3, abs=1e-5)


def test_every_file_is_described_to_the_noise_and_predicted_by_the_others(kind: str, found: Identification) -> None:
    for o in found.observations:
        assert o.rms_joint == pytest.approx(3e-3 * o.size, rel=0.2)
        assert o.rms_joint == pytest.approx(o.rms_individual, rel=0.1)
        assert o.residuals == pytest.approx(o.data - o.fitted)
        assert (o.data.dtype == complex) == (o.quantity == "impedance")
        if kind == "several":
            assert o.rms_predicted == pytest.approx(o.rms_individual, rel=0.2)
            assert not o.not_predicted_because
        else:
            assert o.predicted is None
            assert "no other file" in o.not_predicted_because


def test_statistics_are_the_textbook_s(kind: str, found: Identification) -> None:
    """Of a single file; of several each has its own."""
    s, o = found.statistics, found.observations[0]
    if kind == "several":
        assert s["n"] == sum(len(data.data) for data in found.port.data)
        return
    residuals = np.array([o.residuals.real, o.residuals.imag]) if kind == "spectrum" else o.residuals
    weighted = residuals / np.abs(o.data)
    n, k = residuals.size, 3 + (kind != "spectrum")
    squares = float((weighted**2).sum() if kind == "spectrum" else (residuals**2).sum())
    assert s["n"] == n
    assert s["rmse"] == pytest.approx(np.sqrt(np.mean(residuals**2)))
    assert s["rmse_unit"] == ("ohm" if kind == "spectrum" else "A")
    assert s["aic"] == pytest.approx(n * np.log(squares / n) + 2 * k)
    assert s["bic"] == pytest.approx(n * np.log(squares / n) + np.log(n) * k)
    if kind == "spectrum":
        assert s["relative_rms"] == pytest.approx(np.sqrt(np.mean(weighted**2)))


def test_how_the_fit_ended_is_told(found: Identification) -> None:
    s = found.statistics
    assert 2 <= s["starts_agreeing"] <= s["starts"] or not found.single
    assert s["relative_offset"] < 1e-2
    assert s["identifiability"]["determined"] is True
    assert s["identifiability"]["rank"] == s["identifiability"]["parameters"] == 3


def test_a_fit_leaves_its_covariance_in_the_strip(found: Identification) -> None:
    uncertainty = found.actuator.uncertainty
    assert uncertainty is not None
    assert set(uncertainty.names) == {name for name, p in found.parameters.items() if p.stderr is not None}
    for k, name in enumerate(uncertainty.names):
        p = found.parameters[name]
        assert p.stderr is not None
        assert np.sqrt(uncertainty.covariance[k][k]) == pytest.approx(p.stderr / p.value, rel=1e-9)


@pytest.mark.parametrize("model", ["rc", "rc2"])
@pytest.mark.parametrize("what", ["step", "spectrum", "several"])
def test_correlations_are_correlations(what: str, model: str) -> None:
    strip = replace(two_branches(), coupling=None)
    files = [record(step(), 300.0, 301, strip=strip, noise=1e-3, seed=2).measurement(), spectrum(strip, 1e-4, 1e2)]
    found = identify({"step": files[:1], "spectrum": files[1:]}.get(what, files), model=model, engine="exact")
    matrix = found.fit.correlations
    assert np.diag(matrix) == pytest.approx(1.0)
    assert matrix == pytest.approx(matrix.T)
    assert (np.abs(matrix) <= 1 + 1e-12).all()
    assert np.linalg.eigvalsh(matrix).min() > 0
    names = found.fit.labels
    assert set(found.correlations) == {f"{a}, {b}" for k, a in enumerate(names) for b in names[k + 1 :]}
    assert all(-1 <= value <= 1 for value in found.correlations.values())


def test_correlations_hold_port_and_coupling(kind: str, found: Identification) -> None:
    assert len(found.correlations) == 3 + 6 * (kind in RECORDS)
    assert found.correlations["dc_resistance, dynamic_resistance"] == pytest.approx(found.fit.correlations[0, 1])
    if kind in RECORDS:
        assert found.correlations["coupling_gain, coupling_zero"] < -0.9


# -- Re and the given strip --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("what", ["step", "spectrum"])
def test_what_the_data_fix_does_not_depend_on_the_re_that_was_held(what: str) -> None:
    """One pole: four elements, three observables. Another Re makes other elements and the same port."""
    (file,) = data(what)
    file = replace(file, displacement=None) if what == "step" else file
    none, held = (identify(file, model="rc", electrode_resistance=re, engine="exact") for re in (0.0, 5.0))
    for name in ("steady_conductance", "transient_conductance", "rate", "high_frequency_resistance"):
        assert held.derived[name].value == pytest.approx(none.derived[name].value, rel=1e-5)
    assert held.observations[0].rms_joint == pytest.approx(none.observations[0].rms_joint, rel=1e-6)
    assert held.parameters["dynamic_resistance"].value < 0.8 * none.parameters["dynamic_resistance"].value
    assert held.parameters["electrode_resistance"].value == 5.0
    assert lumped_elements(held.actuator).port.electrode_resistance == pytest.approx(5.0)
    why = "no current or spectrum of a linear port fixes it (any Re below 18.8"
    assert held.parameters["electrode_resistance"].fixed_because.startswith(why)
    assert held.parameters["electrode_resistance"].fixed_because.endswith("held at the value given")


def test_re_of_the_given_actuator_is_held() -> None:
    material = replace(PAPER.material, electrode_resistivity_1=175.0, electrode_thickness_1=2e-6)
    strip = replace(PAPER, material=material)
    m = record(step(), 300.0, 201, strip=strip, noise=1e-3).measurement()
    found = identify(m, base=strip, model="rc")
    assert found.parameters["electrode_resistance"].value == pytest.approx(2.0)
    assert found.parameters["dynamic_resistance"].value == pytest.approx(19.4363, rel=0.005)
    none = identify(m, base=strip, model="rc", electrode_resistance=0.0)
    assert none.parameters["electrode_resistance"].value == 0.0


@pytest.mark.parametrize("what", ["step", "several"])
def test_with_an_electrode_resistance_current_and_displacement_are_fitted_together(what: str) -> None:
    """The tip then follows the voltage behind Re, which the port's parameters make."""
    material = replace(PAPER.material, electrode_resistivity_1=175.0, electrode_thickness_1=2e-6)
    strip = replace(PAPER, material=material)
    voltages = (4.0,) if what == "step" else (4.0, -2.0)
    files = [
        record(step(u), 150.0, 151, strip=strip, rest=20, displacement=True, noise=3e-3, seed=k).measurement(f"{k}.csv")
        for k, u in enumerate(voltages)
    ]
    found = identify(files, base=strip, model="rc", engine="exact")
    assert len(found.fit.parts) == 1
    assert "capacitance, coupling_gain" in found.correlations
    expected = truth(strip)
    for name in (*PORT, *COUPLING):
        p = found.parameters[name]
        assert p.stderr is not None
        assert abs(p.value - expected[name]) < 4 * p.stderr
    assert codes(found.findings) == set()
    for o in found.observations:
        assert o.rms_joint == pytest.approx(o.rms_individual, rel=0.1)
        if what == "several":
            assert o.rms_predicted == pytest.approx(o.rms_individual, rel=0.2)
        else:
            assert o.predicted is None


def test_without_a_displacement_the_given_coupling_stays_and_is_said() -> None:
    m = record(step(), 300.0, 201, noise=1e-3).measurement()
    found = identify(m, base=PAPER, model="rc")
    assert found.actuator.coupling == PAPER.coupling
    assert "coupling-not-fitted" in codes(found.findings)
    assert not set(COUPLING) & set(found.parameters)
    assert identify(m, model="rc").actuator.coupling is None


def test_assumed_geometry_is_said(step_record: Synthetic) -> None:
    found = identify(step_record.measurement(), model="rc", engine="exact")
    assert "no-actuator-coupling" in codes(found.findings)
    assert any("no strip given" in w and "b^2/L_F^2" in w for w in found.warnings)
    without = identify(spectrum(PAPER, 1e-3, 1e2), model="rc")
    assert "no-actuator" in codes(without.findings)


def test_warnings_are_not_repeated() -> None:
    found = identify(record(step(), 300.0, 301, strip=two_branches(), noise=1e-3, seed=1).measurement(), model="rc")
    assert len(set(found.warnings)) == len(found.warnings)


def test_progress_is_counted() -> None:
    calls: list[int] = []
    m = record(step(), 300.0, 101, noise=1e-3).measurement()
    found = identify(m, model="rc", progress=lambda: calls.append(1))
    assert len(calls) == found.statistics["evaluations"] >= 1


def test_nothing_to_identify_is_refused() -> None:
    with pytest.raises(InputError, match="at least one record or spectrum"):
        identify([])


# -- files -------------------------------------------------------------------------------------------------------------


def test_json_has_the_contract_s_keys(kind: str, found: Identification) -> None:
    content = json.loads(json.dumps(found.to_dict(), allow_nan=False))
    assert {"model", "source", "parameters", "derived", "statistics", "warnings", "candidates", "correlations"} <= set(
        content
    )
    assert content["model"] == "rc"
    names = set(UNITS) if kind in RECORDS else {*PORT, "electrode_resistance"}
    assert {name: p["unit"] for name, p in content["parameters"].items()} == {name: UNITS[name] for name in names}
    for name, p in content["parameters"].items():
        assert {"value", "stderr", "unit", "ci95"} <= set(p)
        if name == "electrode_resistance":
            assert "no current or spectrum of a linear port fixes it" in p["held"]
        else:
            low, high = p["ci95"]
            assert low < p["value"] < high
    assert {"rmse", "aic", "bic", "n"} <= set(content["statistics"])
    assert all(isinstance(w, str) for w in content["warnings"])
    assert [r["quantity"] for r in content["records"]] == [o.quantity for o in found.observations]
    assert content["parameters"]["capacitance"]["value"] == found.parameters["capacitance"].value


@pytest.mark.parametrize("what", ["step", "spectrum"])
def test_two_branches_are_named_by_number_and_load_back(what: str, tmp_path: Path) -> None:
    strip = two_branches()
    m = record(step(), 300.0, 301, strip=strip, noise=1e-3, seed=3).measurement()
    found = identify(m if what == "step" else spectrum(strip, 1e-4, 1e2), model="rc2", electrode_resistance=1.0)
    content = found.to_dict()
    names = ["dc_resistance", "resistance_1", "capacitance_1", "resistance_2", "capacitance_2", "electrode_resistance"]
    assert list(content["parameters"]) == names
    assert content["derived"]["time_constant_1"]["value"] < content["derived"]["time_constant_2"]["value"]
    write_actuator(found, tmp_path / "fitted.toml")
    again = load_actuator(tmp_path / "fitted.toml")
    assert again == found.actuator
    assert np.array(lumped_elements(again).port.branches) == pytest.approx(np.array(found.port.port.branches))


def test_toml_loads_back_to_the_fitted_strip(found: Identification, tmp_path: Path) -> None:
    path = tmp_path / "fitted.toml"
    write_actuator(found, path)
    assert load_actuator(path) == found.actuator
    comments = [line for line in path.read_text().splitlines() if line.startswith("#")]
    assert any(", ".join(found.sources) in line and "model rc" in line for line in comments)
    assert any("dc_resistance" in line and "+-" in line for line in comments)


def test_the_strip_has_the_fitted_port(found: Identification) -> None:
    f = np.geomspace(1e-3, 1e2, 20)
    z = lumped_elements(found.actuator, (1e-3, 1e2)).port.impedance(2j * np.pi * f, ideal=True)
    assert z == pytest.approx(found.port.port.impedance(2j * np.pi * f, ideal=True), rel=1e-9)


# -- text and pictures -------------------------------------------------------------------------------------------------


def test_the_table_holds_every_number(kind: str, found: Identification) -> None:
    text = found.summary()
    for name in (*found.parameters, *found.derived):
        assert name in text
    head = {
        "step": "record.csv: step of 4 V at 40 s; model rc, exact in the loop",
        "waveform": "record.csv: waveform from 20 s; model rc, exact in the loop",
        "spectrum": "z.csv: spectrum of 40 points, 1 mHz to 100 Hz; model rc, closed form",
        "several": "2 records and 1 spectrum together, model rc, exact in the loop and closed form",
    }
    assert text.splitlines()[0] == head[kind]
    assert "standard error" in text
    assert "95 % interval" in text
    assert "nan" not in text.lower()
    assert ("from the others" in text) == (kind == "several")


def test_the_picture(kind: str, found: Identification, tmp_path: Path) -> None:
    save(found.figure(), tmp_path / "fit.png")
    assert (tmp_path / "fit.png").read_bytes().startswith(b"\x89PNG")
    if kind == "several":
        axes = found.figure().axes
        assert len(axes) == 2 * len(found.observations) + 1  # data and residuals of each, the comparison
        assert all(a.get_xlabel() for a in axes[1::2])
        assert axes[-1].get_xlabel().startswith("rms of the residuals [%")


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
