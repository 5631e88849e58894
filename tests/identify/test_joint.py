"""Several records of one strip fitted together: what they share, what is their own, what one predicts of another."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from command import Run, assert_one_line
from ilg_circuit.identify.html_report import html
from ilg_circuit.identify.joint_report import joint_table
from synthetic import Synthetic, record, scaled, step

from ilg_circuit.cli import main
from ilg_circuit.errors import InputError
from ilg_circuit.identify import identify
from ilg_circuit.identify.joint import JointFit, fit_jointly
from ilg_circuit.simulation.prediction_band import prediction_band
from ilg_circuit.strip.actuator import PAPER, Actuator
from ilg_circuit.strip.elements import lumped_elements
from ilg_circuit.strip.file import load_actuator

SINH = replace(PAPER, material=replace(PAPER.material, emission_voltage=0.8), coupling=None, name="sinh")


def records(strip: Actuator, voltages: tuple[float, ...], offset: float = 0.0) -> list[Synthetic]:
    return [
        record(step(u), 120.0, 241, strip=strip, rest=20, noise=2e-3, seed=k, current_offset=offset * k)
        for k, u in enumerate(voltages)
    ]


@pytest.fixture(scope="module")
def linear() -> JointFit:
    strip = replace(PAPER, coupling=None)
    return fit_jointly(
        [r.measurement() for r in records(strip, (4.0, -2.0, 1.0), offset=1e-3)], model="rc", base=strip, engine="exact"
    )


@pytest.fixture(scope="module")
def nonlinear() -> JointFit:
    return fit_jointly([r.measurement() for r in records(SINH, (1.0, -2.0, 3.0))], model="rc+sinh", base=SINH)


def test_the_truth_lies_within_the_errors(linear: JointFit) -> None:
    lumped = lumped_elements(PAPER)
    truth = {
        "dc_resistance": lumped.dc_resistance,
        "dynamic_resistance": lumped.dynamic_resistance,
        "capacitance": lumped.capacitance,
    }
    for name, value in truth.items():
        p = linear.parameters[name]
        assert p.stderr is not None
        assert abs(p.value - value) < 4 * p.stderr
        assert p.stderr < 0.05 * value
    assert linear.parameters["electrode_resistance"].held


def test_offsets_are_each_record_s_own(linear: JointFit) -> None:
    assert linear.fit.nuisance == pytest.approx([0.0, 1e-3, 2e-3], abs=3e-4)


def test_each_record_is_as_good_as_by_itself_and_predicted_by_the_others(linear: JointFit) -> None:
    for r in linear.records:
        assert r.joint == pytest.approx(r.own, rel=0.1)
        assert r.predicted == pytest.approx(r.own, rel=0.2)
    assert not linear.warnings


def test_several_voltages_determine_a_nonlinear_electron_path(nonlinear: JointFit) -> None:
    p = nonlinear.parameters["emission_voltage"]
    assert p.stderr is not None
    assert abs(p.value - 0.8) < 4 * p.stderr
    assert p.stderr < 0.05


def test_a_linear_model_of_a_nonlinear_strip_does_not_hold_for_all() -> None:
    found = fit_jointly([r.measurement() for r in records(SINH, (1.0, 3.0))], model="rc", base=SINH, engine="exact")
    assert any("one port does not hold for all" in w for w in found.warnings)
    assert max(r.joint / r.own for r in found.records) > 1.5


def test_one_voltage_is_not_enough_for_a_nonlinear_model_and_that_is_said() -> None:
    made = [r.measurement() for r in records(SINH, (2.0, -2.0))]
    with pytest.raises(InputError, match="needs several voltages"):
        fit_jointly(made, model="rc+sinh", base=SINH)
    with pytest.raises(InputError, match="needs several voltages"):
        identify(made[0], model="rc+sinh", base=SINH)


def test_one_record_is_none_too_many() -> None:
    with pytest.raises(InputError, match="two records or more"):
        fit_jointly([records(PAPER, (1.0,))[0].measurement()], model="rc")


def test_the_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    strip = replace(PAPER, coupling=None)
    files = [str(r.write(tmp_path / f"{k}.csv")) for k, r in enumerate(records(strip, (4.0, 2.0)))]
    out, data, picture = (tmp_path / name for name in ("fit.toml", "fit.json", "fit.png"))
    with pytest.raises(SystemExit) as ended:
        main(["identify", *files, "--model", "rc", "--actuator", "paper", "--engine", "exact",
              "--out", str(out), "--json", str(data), "--plot", str(picture)])  # fmt: skip
    assert ended.value.code == 0
    text = capsys.readouterr().out
    assert "2 records together, model rc" in text
    assert "from the others" in text
    content = json.loads(data.read_text())
    assert [r["source"] for r in content["records"]] == ["0.csv", "1.csv"]
    assert load_actuator(out).uncertainty is not None
    assert picture.read_bytes().startswith(b"\x89PNG")
    value = content["parameters"]["dc_resistance"]["value"]
    assert np.isfinite(value)
    assert lumped_elements(load_actuator(out)).dc_resistance == pytest.approx(value)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--own", "stiffness"], "model rc has no stiffness"),
        (["--bias", "1V"], "it is for the spectra among the files, and there is none"),
        (["--electrode-resistance", "fit"], "for every Re below"),
        (["--electrode-resistance", "30ohm"], "too large"),
    ],
)
def test_refusals(run: Run, tmp_path: Path, options: list[str], message: str) -> None:
    files = [str(r.write(tmp_path / f"{k}.csv")) for k, r in enumerate(records(PAPER, (4.0, 2.0)))]
    assert_one_line(run("identify", *files, "--model", "rc", "--engine", "exact", *options), message)


@pytest.mark.parametrize("option", ["--own", "--bias"])
def test_what_only_several_files_can_have(run: Run, tmp_path: Path, option: str) -> None:
    (file,) = (str(r.write(tmp_path / "one.csv")) for r in records(PAPER, (4.0,)))
    assert_one_line(run("identify", file, option, "capacitance"), f"{option} is for several files")


def test_the_joint_interval_is_narrower_than_any_record_s_own(linear: JointFit) -> None:
    strip = replace(PAPER, coupling=None)
    for r in records(strip, (4.0, -2.0, 1.0), offset=1e-3):
        alone = identify(r.measurement(), base=strip, model="rc", engine="exact")
        for name in ("dynamic_resistance", "capacitance"):
            own, joint = alone.parameters[name].stderr, linear.parameters[name].stderr
            assert own is not None
            assert joint is not None
            assert joint < own


def test_what_one_record_does_not_share_is_its_own() -> None:
    made = [r.measurement() for r in records(SINH, (1.0, -3.0))]
    # the chords of the sinh law, 5.2 ohm per volt and more, behind what both share
    found = fit_jointly(made, model="rc", base=SINH, own=["dc_resistance"], engine="exact")
    lumped = lumped_elements(SINH)
    sources = list(found.own)
    chords = [u / (lumped.port.saturation_current * np.sinh(u / 0.8)) for u in (1.0, 3.0)]
    for source, chord in zip(sources, chords, strict=True):
        p = found.own[source]["dc_resistance"]
        assert p.ci95 is not None
        assert p.stderr is not None
        assert abs(p.value - chord) < 4 * p.stderr
    assert found.parameters["dc_resistance"].value == pytest.approx(np.sqrt(np.prod(
        [found.own[s]["dc_resistance"].value for s in sources])))  # fmt: skip
    assert found.parameters["capacitance"].value == pytest.approx(lumped.capacitance, rel=0.01)
    assert all(r.joint < 1.1 * r.own for r in found.records)
    # of what is its own the others know only their mean
    assert all(r.predicted is not None and r.predicted > 3 * r.own for r in found.records)
    assert json.loads(json.dumps(found.to_json()))["own"][sources[0]]["dc_resistance"]["unit"] == "ohm"
    assert "own to each record" in joint_table(found)


def test_a_stranger_among_three_is_named() -> None:
    strip = replace(PAPER, coupling=None)
    made = [replace(r.measurement(), source=f"good{k}") for k, r in enumerate(records(strip, (3.0, -2.0)))]
    (other,) = records(replace(scaled(size=1.5), coupling=None), (2.5,))
    found = fit_jointly([*made, replace(other.measurement(), source="odd")], model="rc", base=strip, engine="exact")
    assert any("without odd one port holds for all others" in w for w in found.warnings)
    assert "one port does not hold for all" in found.warnings[0]


def test_a_bad_record_among_good_ones_is_named() -> None:
    good = records(PAPER, (3.0, -2.0))
    noise = np.random.default_rng(0).standard_normal(len(good[1].columns["time"]))
    bad = replace(good[1].changed(current=good[1].columns["current"] + 0.03 * noise).measurement(), source="bad.csv")
    found = fit_jointly([good[0].measurement(), bad], model="rc", engine="exact")
    assert any(w.startswith("no port describes bad.csv (") for w in found.warnings)
    # it has little weight: the good one still decides
    assert found.parameters["capacitance"].value == pytest.approx(0.35, rel=0.02)


def test_a_record_without_any_transient_is_refused_by_name(run: Run, tmp_path: Path) -> None:
    good = records(PAPER, (3.0, -2.0))
    files = [str(good[0].write(tmp_path / "good.csv")),
             str(good[1].changed(current=np.zeros(261)).write(tmp_path / "dead.csv"))]  # fmt: skip
    assert_one_line(run("identify", *files, "--model", "rc"), "dead.csv", "the current is zero throughout")


def test_one_record_given_twice_is_refused() -> None:
    (one,) = records(PAPER, (3.0,))
    with pytest.raises(InputError, match="repeats the readings of"):
        fit_jointly([one.measurement(), one.measurement()], model="rc")


def test_very_different_sampling() -> None:
    strip = replace(PAPER, coupling=None)
    sparse = record(step(2.0), 300.0, 16, strip=strip, noise=2e-3, seed=3)
    dense = record(step(-1.0), 40.0, 4001, strip=strip, rest=50, noise=2e-3, seed=4)
    found = fit_jointly([sparse.measurement(), dense.measurement()], model="rc", base=strip)
    lumped = lumped_elements(strip)
    truth = (lumped.dc_resistance, lumped.dynamic_resistance, lumped.capacitance)
    for p, value in zip(found.parameters.values(), truth, strict=False):
        assert p.stderr is not None
        assert abs(p.value - value) < 4 * p.stderr
    assert found.records[0].joint < 1.6 * found.records[0].own


def test_re_is_determined_by_what_is_not_linear() -> None:
    """Re = 2 ohm divides the voltage of the sinh law: several voltages tell it, to some per cent."""
    strip = replace(SINH, material=replace(SINH.material, electrode_resistivity_1=175.0, electrode_thickness_1=2e-6))
    made = [r.measurement() for r in records(strip, (1.0, -2.0, 3.0))]
    found = fit_jointly(made, model="rc+sinh", base=SINH, electrode_resistance="fit")
    p = found.parameters["electrode_resistance"]
    assert p.stderr is not None
    assert abs(p.value - 2.0) < 4 * p.stderr
    assert p.stderr < 0.2
    assert not p.held
    assert found.actuator.uncertainty is not None
    assert "electrode_resistance" in found.actuator.uncertainty.names
    band = prediction_band(found.actuator, step(2.0), np.linspace(0.0, 60.0, 31))
    assert 0 < band.stderr["current"].max() < 1e-3


def test_re_that_is_not_there_is_held_at_zero_and_said() -> None:
    made = [record(step(u), 60.0, 31, strip=SINH, rest=5, noise=5e-3).measurement() for u in (1.0, 3.0)]
    found = fit_jointly(made, model="rc+sinh", base=SINH, electrode_resistance="fit")
    assert found.parameters["electrode_resistance"].held
    assert any("electrode resistance is not determined" in w for w in found.warnings)
    assert found.parameters["emission_voltage"].value == pytest.approx(0.8, abs=0.04)
    assert all(r.predicted is None and "the others are all at one voltage" in r.unforeseen for r in found.records)


def test_the_report_shows_every_record(linear: JointFit) -> None:
    page = html(linear, "ilg-circuit identify a.csv b.csv --model rc")
    for name in linear.parameters:
        assert name in page
    for r in linear.records:
        assert f"<td>{r.source}</td>" in page
        assert f"{r.joint / r.size:.2%}" in page
    assert "from the others" in page
    assert "ilg-circuit identify a.csv b.csv --model rc" in page
    assert page.count("data:image/png;base64,") == 2
