"""Steps, spectra and displacements in one fit, and the model chosen for all of them; truths are known."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from itertools import count
from pathlib import Path

import numpy as np
import pytest
from command import Run, assert_one_line
from ilg_circuit.identify.joint_report import joint_figure, joint_table
from synthetic import Synthetic, record, step, two_branches

from ilg_circuit.fit.estimate import Parameter
from ilg_circuit.identify import Record, Spectrum, identify, read_record
from ilg_circuit.identify.joint import JointFit, fit_jointly
from ilg_circuit.strip.actuator import PAPER, Actuator
from ilg_circuit.strip.elements import lumped_elements
from ilg_circuit.strip.file import load_actuator

M = PAPER.material
DIFFUSING = replace(PAPER, material=replace(M, diffusion_time=30.0), coupling=None, name="diffusing")
SINH = replace(PAPER, material=replace(M, emission_voltage=0.8), coupling=None, name="sinh")


def spectrum(strip: Actuator, low: float, high: float, *, bias: float = 0.0, seed: int = 0) -> Spectrum:
    """The port's closed form at 40 frequencies, with noise of 0.3 % in each part."""
    f = np.geomspace(low, high, 40)
    random = np.random.default_rng(seed)
    z = lumped_elements(strip, (low / 2, 2 * high)).port.impedance(2j * np.pi * f, bias, ideal=True)
    return Spectrum("z.csv", f, z * (1 + 3e-3 * (random.standard_normal(40) + 1j * random.standard_normal(40))))


def named(made: Synthetic, source: str) -> Record:
    return replace(made.measurement(), source=source)


def assert_holds(p: Parameter, truth: float, most: float) -> None:
    """The truth within four standard errors, and these below the part ``most`` of it."""
    assert p.stderr is not None
    assert abs(p.value - truth) < 4 * p.stderr
    assert p.stderr < most * truth


@pytest.fixture(scope="module")
def two_kinds() -> JointFit:
    """rc2: the spectrum ends where the slow branch begins, the step begins where the fast one is over."""
    strip = replace(two_branches(), coupling=None)
    slow = record(step(2.0), 200.0, 101, strip=strip, rest=10, noise=3e-3, seed=1)
    return fit_jointly([named(slow, "step.csv"), spectrum(strip, 1e-2, 1e3)], model="rc2", base=strip)


def test_a_step_and_a_spectrum_together(two_kinds: JointFit) -> None:
    lumped = lumped_elements(two_branches())
    ((r1, c1), (r2, c2)) = lumped.port.branches
    for name, truth in (("resistance_1", r1), ("capacitance_1", c1), ("resistance_2", r2), ("capacitance_2", c2)):
        assert_holds(two_kinds.parameters[name], truth, 0.15)
    assert [r.quantity for r in two_kinds.records] == ["current", "impedance"]
    assert all(r.joint < 1.2 * r.own for r in two_kinds.records)
    assert two_kinds.records[1].data.dtype == complex
    assert not two_kinds.warnings


def test_the_joint_fit_knows_more_than_either(two_kinds: JointFit) -> None:
    strip = replace(two_branches(), coupling=None)
    slow = record(step(2.0), 200.0, 101, strip=strip, rest=10, noise=3e-3, seed=1)
    alone = identify(slow.measurement(), base=strip, model="rc2")
    for name in ("resistance_1", "capacitance_1", "resistance_2", "capacitance_2"):
        own, joint = alone.parameters[name].stderr, two_kinds.parameters[name].stderr
        assert own is not None
        assert joint is not None
        assert joint < own


def test_what_the_data_fix_is_given_beside_the_re_that_was_held(two_kinds: JointFit) -> None:
    """Another Re makes other elements, and the same port: resistances at both ends stay, and so does every misfit."""
    held = two_kinds.parameters["electrode_resistance"]
    assert "no current or spectrum of a linear port fixes it (any Re below 17" in held.held
    strip = replace(two_branches(), coupling=None)
    slow = record(step(2.0), 200.0, 101, strip=strip, rest=10, noise=3e-3, seed=1)
    other = fit_jointly(
        [named(slow, "step.csv"), spectrum(strip, 1e-2, 1e3)], model="rc2", base=strip, electrode_resistance=10.0
    )
    for name in ("steady_resistance", "high_frequency_resistance"):
        a, b = two_kinds.derived[name], other.derived[name]
        assert b.value == pytest.approx(a.value, rel=1e-4)
        assert a.stderr is not None
        assert b.stderr == pytest.approx(a.stderr, rel=0.02)
    assert other.parameters["resistance_1"].value < 0.6 * two_kinds.parameters["resistance_1"].value
    for mine, theirs in zip(two_kinds.records, other.records, strict=True):
        assert theirs.joint == pytest.approx(mine.joint, rel=1e-4)


def test_diffusion_from_a_short_step_and_a_spectrum_that_each_see_half_of_it() -> None:
    short = named(record(step(-1.0), 20.0, 81, strip=DIFFUSING, rest=10, noise=3e-3, seed=2), "step.csv")
    found = fit_jointly([short, spectrum(DIFFUSING, 3e-2, 1e2)], model="warburg", base=DIFFUSING)
    port = lumped_elements(DIFFUSING).port
    assert port.ladder is not None
    assert_holds(found.parameters["warburg_resistance"], port.ladder.constants[0], 0.05)
    assert_holds(found.parameters["diffusion_time"], 30.0, 0.1)
    fitted = found.actuator.material
    assert fitted.ladder_lowest is not None
    assert fitted.ladder_lowest <= 3e-2
    assert fitted.ladder_highest is not None
    assert fitted.ladder_highest >= 1e2


def test_a_spectrum_about_zero_and_a_step_tell_what_is_not_ohmic() -> None:
    """Re Z at low frequency is Rdc near 0 V, the step's steady current the chord at 2 V: two voltages."""
    high = named(record(step(2.0), 100.0, 101, strip=SINH, rest=10, noise=2e-3, seed=3), "step.csv")
    about = [spectrum(SINH, 1e-4, 10.0), replace(spectrum(SINH, 1e-4, 10.0, bias=1.0, seed=1), source="biased.csv")]
    found = fit_jointly([high, *about], model="rc+sinh", base=SINH, bias=[0.0, 0.0, 1.0])
    assert_holds(found.parameters["emission_voltage"], 0.8, 0.02)
    assert_holds(found.parameters["dc_resistance"], lumped_elements(SINH).dc_resistance, 0.02)
    assert [r.voltage for r in found.records] == [2.0, 0.0, 1.0]


@pytest.fixture(scope="module")
def moving() -> JointFit:
    """Three records, two of them with a displacement, each with a rest position of its own, one with a drift."""
    made = [
        named(record(step(4.0), 150.0, 151, rest=20, displacement=True, noise=3e-3, rest_position=5e-3, seed=1), "a"),
        named(record(step(-2.0), 150.0, 151, rest=20, displacement=True, noise=3e-3, rest_position=-1e-3, drift=2e-6,
                     seed=2), "b"),
        named(record(step(1.0), 150.0, 151, rest=20, noise=3e-3, seed=3), "c"),
    ]  # fmt: skip
    return fit_jointly(made, model="rc", base=PAPER, engine="exact")


def test_the_coupling_is_one_for_all_records_that_move(moving: JointFit) -> None:
    truth = PAPER.coupling
    assert truth is not None
    for name, value in (("gain", truth.gain), ("zero", truth.zero), ("damping_ratio", truth.damping_ratio),
                        ("natural_frequency", truth.natural_frequency)):  # fmt: skip
        assert_holds(moving.parameters[f"coupling_{name}"], value, 0.05)
    assert moving.displacement is not None
    assert moving.displacement.sources == ("a", "b")
    assert moving.displacement.own[1].drift == pytest.approx(2e-6, rel=0.1)
    for k in range(2):
        own = moving.displacement.own[k].fit.errors
        joint = moving.displacement.together
        assert joint is not None
        assert (joint.fit.errors < own).all()


def test_displacements_are_predicted_from_the_others_too(moving: JointFit) -> None:
    rows = [r for r in moving.records if r.quantity == "displacement"]
    assert [r.source for r in rows] == ["a", "b"]
    for r in rows:
        assert r.predicted is not None
        assert r.joint < 1.1 * r.own
        assert r.predicted < 1.3 * r.own
        assert r.residuals == pytest.approx(r.data - r.fitted)


def test_everything_is_in_json_table_and_picture(moving: JointFit) -> None:
    content = json.loads(json.dumps(moving.to_json(), allow_nan=False))
    assert [(r["source"], r["quantity"]) for r in content["records"]] == [
        ("a", "current"), ("b", "current"), ("c", "current"), ("a", "displacement"), ("b", "displacement")
    ]  # fmt: skip
    assert content["parameters"]["coupling_gain"]["unit"] == "m/(V s)"
    text = joint_table(moving)
    assert "3 records together, model rc" in text
    assert sum("displacement" in row for row in text.splitlines()[-8:]) >= 2
    axes = joint_figure(moving).axes
    assert len(axes) == 2 * len(moving.records) + 1  # data and residuals of each, the comparison
    assert all(a.get_xlabel() for a in axes[1::2])
    assert axes[-1].get_xlabel().startswith("rms of the residuals [%")


def test_a_camera_on_the_other_side_is_named() -> None:
    made = [
        named(record(step(u), 150.0, 101, rest=20, displacement=True, noise=3e-3, axis=axis, seed=k), f"{k}.csv")
        for k, (u, axis) in enumerate(((4.0, 1.0), (-2.0, 1.0), (3.0, -1.0)))
    ]
    found = fit_jointly(made, model="rc", base=PAPER, engine="exact")
    assert any(w.startswith("2.csv: its displacement moves against that of the others") for w in found.warnings)
    assert found.displacement is not None
    assert found.displacement.sources == ("0.csv", "1.csv")


def records(strip: Actuator, voltages: tuple[float, ...]) -> list[Record]:
    return [
        named(record(step(u), 100.0, 101, strip=strip, rest=20, noise=3e-3, seed=k), f"{k}.csv")
        for k, u in enumerate(voltages)
    ]


@pytest.mark.parametrize(
    ("strip", "voltages", "model", "verdicts"),
    [
        (replace(PAPER, coupling=None), (2.0, -1.0), "rc", {"rc2": "not tried: rc leaves nothing but noise"}),
        (replace(PAPER, coupling=None), (2.0, -2.0), "rc", {"rc+sinh": "not tried: it needs several voltages"}),
        (SINH, (1.0, -2.0, 3.0), "rc+sinh", {"rc": "worse"}),
    ],
    ids=["linear", "one voltage", "sinh"],
)
def test_auto(strip: Actuator, voltages: tuple[float, ...], model: str, verdicts: dict[str, str]) -> None:
    found = fit_jointly(records(strip, voltages), base=strip)
    assert found.model == model
    rows = {c.model: c for c in found.candidates}
    assert [m for m, c in rows.items() if c.chosen] == [model]
    for name, verdict in verdicts.items():
        assert rows[name].verdict.startswith(verdict)
    assert "verdict" in joint_table(found)


def test_auto_of_a_step_and_a_spectrum() -> None:
    strip = replace(two_branches(), coupling=None)
    slow = record(step(2.0), 200.0, 101, strip=strip, rest=10, noise=3e-3, seed=1)
    found = fit_jointly([named(slow, "step.csv"), spectrum(strip, 1e-2, 1e3)], base=strip, engine="exact")
    assert found.model == "rc2"
    assert {"cpe", "warburg", "rc3"} <= {c.model for c in found.candidates}


def test_the_command_with_both_kinds(run: Run, tmp_path: Path) -> None:
    strip = replace(PAPER, coupling=None)
    made = record(step(2.0), 100.0, 101, strip=strip, rest=10, noise=3e-3, seed=1)
    file = made.write(tmp_path / "step.csv")
    z = spectrum(strip, 1e-3, 1e2)
    table = tmp_path / "z.csv"
    rows = zip(z.frequency.tolist(), z.impedance.real.tolist(), z.impedance.imag.tolist(), strict=True)
    table.write_text("frequency_Hz,re_ohm,im_ohm\n" + "\n".join(f"{f},{re},{im}" for f, re, im in rows))
    outcome = run("identify", str(file), str(table), "--model", "rc", "--actuator", "paper", "--out", "fit.toml",
                  "--json", "fit.json", "--plot", "fit.png", "--bias", "z.csv=0V")  # fmt: skip
    assert outcome.code == 0, outcome.err
    assert "1 record and 1 spectrum together, model rc" in outcome.out
    content = json.loads(Path("fit.json").read_text())
    assert [r["quantity"] for r in content["records"]] == ["current", "impedance"]
    assert "step.csv, z.csv" in Path("fit.toml").read_text()
    value = content["parameters"]["capacitance"]["value"]
    assert lumped_elements(load_actuator("fit.toml")).port.capacitance == pytest.approx(value)
    assert Path("fit.png").read_bytes().startswith(b"\x89PNG")
    assert_one_line(run("identify", str(file), str(table), "--model", "rc", "--bias", "q.csv=1V"), "'q.csv' is not one")


def test_the_real_step_split_in_two(shared_data: Callable[[str], Path], tmp_path: Path) -> None:
    """Every second sample each: two records of one strip, which predict one another."""
    header, *rows = shared_data("ipmc_step/step_1V5.csv").read_text().splitlines()
    made = []
    for name, k in zip(("even", "odd"), count(), strict=False):
        path = tmp_path / f"{name}.csv"
        path.write_text("\n".join([header, *rows[k::2]]))
        made.append(replace(read_record(path), displacement=None))
    found = fit_jointly(made, model="rc2")
    for r in found.records:
        assert r.predicted is not None
        assert r.joint < 1.2 * r.own
        assert r.predicted < 1.6 * r.own
        assert 0.003 < r.own / r.size < 0.02
    whole = identify(replace(read_record(shared_data("ipmc_step/step_1V5.csv")), displacement=None), model="rc2")
    for name in ("resistance_1", "capacitance_2"):
        assert found.parameters[name].value == pytest.approx(whole.parameters[name].value, rel=0.1)
    assert found.parameters["resistance_1"].bootstrap is not None
