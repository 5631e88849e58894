"""Several records of one strip fitted together: what they share, what is their own, what one predicts of another."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from synthetic import Record, record, step

from ilg_circuit.actuator import PAPER, Actuator
from ilg_circuit.actuator_file import load_actuator
from ilg_circuit.cli import main
from ilg_circuit.elements import lumped_elements
from ilg_circuit.errors import InputError
from ilg_circuit.identify import identify
from ilg_circuit.identify.html_report import html
from ilg_circuit.identify.joint import JointFit, fit_jointly

SINH = replace(PAPER, material=replace(PAPER.material, emission_voltage=0.8), coupling=None, name="sinh")


def records(strip: Actuator, voltages: tuple[float, ...], offset: float = 0.0) -> list[Record]:
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
    return fit_jointly([r.measurement() for r in records(SINH, (1.0, -2.0))], model="rc+sinh", base=SINH)


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
    # the first record has none to find
    assert linear.fit.nuisance == pytest.approx([1e-3, 2e-3], abs=3e-4)


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


def test_several_files_need_the_name_of_a_model(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    files = [str(r.write(tmp_path / f"{k}.csv")) for k, r in enumerate(records(PAPER, (4.0, 2.0)))]
    with pytest.raises(SystemExit) as ended:
        main(["identify", *files])
    assert ended.value.code == 2
    assert "name it, as in --model rc2" in capsys.readouterr().err


def test_the_report_shows_every_record(linear: JointFit) -> None:
    page = html(linear, "ilg-circuit identify a.csv b.csv --model rc")
    for name in linear.parameters:
        assert name in page
    for r in linear.records:
        assert f"<td>{r.source}</td>" in page
        assert f"{r.joint / r.peak:.2%}" in page
    assert "from the others" in page
    assert "ilg-circuit identify a.csv b.csv --model rc" in page
    assert page.count("data:image/png;base64,") == 3
