"""What holds for every registered form of drive: its examples are drives, errors and help show them."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from command import Run

from ilg_circuit.drive import PiecewiseLinear
from ilg_circuit.errors import InputError
from ilg_circuit.findings import codes
from ilg_circuit.simulation.drives import DRIVE_FORMS, FORMS, MOTION_FORMS, Form, parse_drive
from ilg_circuit.simulation.response import simulate
from ilg_circuit.strip.actuator import PAPER

DURATION = 60.0


@pytest.mark.parametrize("form", FORMS, ids=lambda form: form.name)
@pytest.mark.parametrize(("k", "unit", "column"), [(0, "V", "voltage_V"), (1, "m", "position_mm")])
def test_its_examples_are_drives(form: Form, k: int, unit: str, column: str, run: Run) -> None:
    for name in ("drive.csv", "motion.csv"):
        Path(name).write_text(f"time_s,{column}\n0,1\n1,2\n")
    for example in re.sub(r"\[,\w+\]", lambda m: ",0.5" if m[0] == "[,duty]" else ",3", form.examples[k]).split(", "):
        assert example.startswith(f"{form.name}:")
        drive = parse_drive(example, DURATION, unit)
        assert np.isfinite(drive.value(np.linspace(0, DURATION, 7))).all()
        assert drive.largest() > 0


@pytest.mark.parametrize(("unit", "forms"), [("V", DRIVE_FORMS), ("m", MOTION_FORMS)])
def test_errors_name_every_form(unit: str, forms: str) -> None:
    assert all(f"{form.name}:" in forms for form in FORMS)
    with pytest.raises(InputError, match=re.escape(forms)):
        parse_drive("sawtooth:1V", DURATION, unit)


@pytest.mark.parametrize(("command", "k"), [("simulate", 0), ("sweep", 0), ("design", 0), ("netlist", 0), ("sense", 1)])
def test_help_lists_every_form_and_what_it_means(command: str, k: int, run: Run) -> None:
    shown = " ".join(run(command, "--help").out.split())
    for form in FORMS:
        assert f"{form.examples[k].split(', ')[0]} {form.meaning}" in shown
    assert "30 s is the period" in shown


def test_a_file_s_name_may_hold_commas(run: Run) -> None:
    Path("a, b.csv").write_text("time_s,voltage_V\n0,1\n1,2\n")
    assert parse_drive("file:a, b.csv", DURATION).value([0.0, 0.5]).tolist() == [1.0, 1.5]


# -- drives from files -------------------------------------------------------------------------------------------------


def drawn(text: str, duration: float = DURATION, name: str = "drive.csv") -> PiecewiseLinear:
    Path(name).write_text("time_s,voltage_V\n" + text.replace(" ", "\n") + "\n")
    drive = parse_drive(f"file:{name}", duration)
    assert isinstance(drive, PiecewiseLinear)
    return drive


def test_two_rows_at_one_time_are_a_jump(run: Run) -> None:
    drive = drawn("0,0 10,0 10,4 30,4 30,1 30,-1 60,-1")
    assert drive.findings == ()
    assert drive.jumps(DURATION).tolist() == [10.0, 30.0]
    assert drive.value([9.999999, 10.0, 29.999999, 30.0]).tolist() == [0.0, 4.0, 4.0, -1.0]
    t = np.linspace(0, 60, 601)
    response = simulate(PAPER, drive, t, engine="exact")
    assert (response.current[t < 10] == 0).all()
    # before the second edge it is the answer to a step at 10 s
    after = (t >= 10) & (t < 30)
    expected = simulate(PAPER, PiecewiseLinear.step(4.0), t[after] - 10, engine="exact").current
    assert response.current[after] == pytest.approx(expected, rel=1e-9)


def test_a_time_that_goes_back_is_refused(run: Run) -> None:
    with pytest.raises(InputError, match=r"drive\.csv: line 4: time 9 s goes back from 10 s"):
        drawn("0,0 10,0 9,4")


def test_a_run_begins_at_the_file_s_first_time(run: Run) -> None:
    drive = drawn("-5,0 0,4 60,4", 65.0)
    (finding,) = drive.findings
    assert (finding.code, finding.values) == ("drive-begins-earlier", {"first": -5.0})
    assert drive.value([0.0, 2.5, 5.0, 65.0]).tolist() == [0.0, 2.0, 4.0, 4.0]
    response = simulate(PAPER, drive, np.linspace(0, 65, 66), engine="exact")
    assert str(finding) in response.warnings
    assert abs(response.current[0]) < 1e-12
    assert response.current.max() < 0.16


@pytest.mark.parametrize(("rows", "begin"), [("-5,0 0,0 0,4 60,4", 4.0), ("-5,0 -2,0 0,0 1,4 60,4", 0.0)])
def test_rest_before_zero_is_left_out(rows: str, begin: float, run: Run) -> None:
    """A strip at rest at 0 V is what every run begins with; t = 0 stays that of the file."""
    drive = drawn(rows)
    assert drive.findings == ()
    assert drive.value([0.0, DURATION]).tolist() == [begin, 4.0]


@pytest.mark.parametrize(
    ("rows", "duration", "expected"),
    [
        ("0,1 60,4", 60.0, set()),
        ("0,1 60,4", 59.0, set()),
        ("5,0 6,4 60,4", 60.0, {"drive-held-before"}),
        ("0,0 6,4", 60.0, {"drive-held-after"}),
        ("5,0 6,4 60,4", 300.0, {"drive-held-before", "drive-held-after"}),
        ("-5,1 0,4 60,4", 65.0, {"drive-begins-earlier"}),
        ("-5,1 0,4 60,4", 66.0, {"drive-begins-earlier", "drive-held-after"}),
        ("-0.25,0 0,4 60,4", 60.0, {"drive-begins-earlier"}),
        ("0,0 10,9.9e37 20,2 60,4", 60.0, {"readings-marked"}),
    ],
)
def test_what_a_file_leaves_open_is_told(rows: str, duration: float, expected: set[str], run: Run) -> None:
    found = drawn(rows, duration).findings
    assert codes(found) == expected
    assert all(f.subject == "file drive.csv" for f in found)


def test_every_command_tells_it(run: Run) -> None:
    Path("drive.csv").write_text("time_s,voltage_V\n5,0\n6,4\n10,4\n")
    Path("motion.csv").write_text("time_s,position_mm\n5,0\n6,1\n10,1\n")
    drive = ("--drive", "file:drive.csv", "--duration", "20s")
    for command in (
        ("simulate", "paper", *drive, "--engine", "exact", "--samples", "21"),
        ("sense", "paper", "--motion", "file:motion.csv", *drive[2:], "--engine", "exact", "--samples", "21"),
        ("netlist", "paper", *drive, "--out", "paper.cir"),
        ("sweep", "paper", *drive, "--engine", "exact", "--vary", "width=4mm:6mm:2", "--jobs", "1", "--out", "s.nc"),
    ):
        outcome = run(*command)
        assert outcome.code == 0, outcome.err
        assert "its first row is at 5 s: from t = 0 to it the first level is held" in outcome.err, command
        assert "its last row is at t = 10 s" in outcome.err, command


def test_a_drive_needs_only_its_own_column(run: Run) -> None:
    Path("drive.csv").write_text("time_s,voltage_V,current_mA/cm2,displacement_px\n0,1,x,2\n60,2,x,3\n")
    assert parse_drive("file:drive.csv", DURATION).value(60.0) == 2.0
